block ArDroneMpc "Landing on decks that move in waves, with model predictive control"
  extends Fleet.DeckLanding(redeclare Fleet.MpcController tracking);
equation
  tracking.deck_velocity = {target.velocity.x, target.velocity.y, target.velocity.z};
  tracking.deck_share = share;
end ArDroneMpc;
