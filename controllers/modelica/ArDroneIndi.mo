block ArDroneIndi "Landing on decks that move in waves, with incremental nonlinear dynamic inversion against wind"
  extends Fleet.DeckLanding(redeclare Fleet.IndiController tracking);
end ArDroneIndi;
