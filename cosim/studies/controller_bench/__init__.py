"""The bench for controllers: a candidate takes the place of a shipped controller in every scenario that has its role."""
