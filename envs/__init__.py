"""PettingZoo environments. The public module is `envs.rendezvous_v0`."""
