block ArDroneLqr "Landing on decks that move in waves, with a linear-quadratic regulator with integral action"
  extends Fleet.DeckLanding(redeclare Fleet.LqrController tracking);
end ArDroneLqr;
