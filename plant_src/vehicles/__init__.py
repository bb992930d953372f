"""Vehicle models, one package each, and the packages that they share."""
