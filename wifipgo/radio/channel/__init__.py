"""What a link carries: CSI, noise and faults of receivers, effective SNR and rate."""
