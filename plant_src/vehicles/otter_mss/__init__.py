"""The Otter exactly as in the Marine Systems Simulator: linear restoring."""
