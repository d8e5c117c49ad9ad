"""Trained policies: what they are shown, how they answer, and their networks, in numpy."""
