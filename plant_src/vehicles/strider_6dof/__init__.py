"""The Strider V1.0 catamaran in six degrees of freedom, afloat in waves."""
