block DeckFilter "Motion of a landing deck relative to the quadcopter, from the filter of the vessel and sights of a marker"
  extends Estimation.DeckFilter;
end DeckFilter;
