"""Episodes as films and as logs of a timeline."""
