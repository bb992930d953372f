"""The flat model as data, and its evaluation."""
