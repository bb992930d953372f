"""The published simulator rebuilt, with its conventions: signal interface, force models, controllers."""
