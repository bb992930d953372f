block ArDroneGeometric "Landing on decks that move in waves: path command in still water, deck motion as feed-forward, geometric tracking"
  extends Fleet.DeckLanding(redeclare Fleet.GeometricController tracking);
end ArDroneGeometric;
