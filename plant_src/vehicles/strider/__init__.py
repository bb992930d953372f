"""The Strider V1.0 catamaran with a landing deck."""
