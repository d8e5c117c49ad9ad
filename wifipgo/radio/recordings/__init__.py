"""CSI recordings of real radios: Intel 5300 logs, the WSR data set, their bearings."""
