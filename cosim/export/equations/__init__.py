"""Export of continuous models whose equations are CasADi expressions."""
