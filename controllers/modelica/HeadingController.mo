block HeadingController "Heading loop: from heading reference to the rudder angle of a vessel"
  extends Fleet.HeadingController;
end HeadingController;
