"""Why a policy wins or loses: when it meets, how far it goes and where errors grow, beside another."""
