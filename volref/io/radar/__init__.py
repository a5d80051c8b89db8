"""Weather radars from files: ODIM_H5, .npz, and by xradar all else."""
