"""The flat model as immutable data, its traversal and its evaluation."""
