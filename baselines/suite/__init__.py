"""A suite of scenarios that policies are compared on, fixed by its version so that a paper can cite it."""
