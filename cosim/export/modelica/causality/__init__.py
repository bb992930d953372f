"""Order of computation: matching, sorting, clocks, states, parameter roles."""
