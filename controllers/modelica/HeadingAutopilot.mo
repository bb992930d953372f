block HeadingAutopilot "Heading loop of a vessel with integral action and a wave filter"
  extends Fleet.HeadingAutopilot;
end HeadingAutopilot;
