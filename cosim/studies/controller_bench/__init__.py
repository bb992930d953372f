"""Controller benchmark: a candidate replaces the shipped controller in every scenario with its role."""
