"""Radio wing: paths, CSI, links, angle of arrival, recordings."""
