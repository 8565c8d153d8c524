# Arguments: the sample, a truth file, the model's first time. Prints the largest difference between truth and
# xarray's interpolation, m/s, the slope of the energy spectrum, and the divergence as a share of the gradients.
import sys
import numpy as np
import xarray as xr

sample, truth, first_s = sys.argv[1], sys.argv[2], float(sys.argv[3])
ds = xr.open_dataset(sample, decode_times=False)
rows = np.genfromtxt(truth, delimiter=",", names=True)
rows = rows[(rows["z_m"] > 10) & (rows["z_m"] < 110)]
# The show's x is towards north, the model's towards east; the show stands in the middle of the points of w.
at = {
    "time": xr.DataArray(first_s + rows["time_s"], dims="row"),
    "x": xr.DataArray(160.0 - rows["y_m"], dims="row"),
    "y": xr.DataArray(160.0 + rows["x_m"], dims="row"),
    "z": xr.DataArray(rows["z_m"], dims="row"),
}
worst = 0.0
for name, axes, column in [
    ("u", ("xu", "y", "zu_3d"), "east_mps"),
    ("v", ("x", "yv", "zu_3d"), "north_mps"),
    ("w", ("x", "y", "zw_3d"), "up_mps"),
]:
    x, y, z = axes
    found = ds[name].interp({"time": at["time"], x: at["x"], y: at["y"], z: at["z"]}, method="linear")
    worst = max(worst, float(np.abs(found.values - rows[column]).max()))

u, v, w = (ds[name].isel(time=0).values.astype(float) for name in "uvw")
dx, dy, dz = 10.0, 10.0, 8.0
nz, ny, nx = w.shape
energy = sum(np.abs(np.fft.fftn(one - one.mean()) / one.size) ** 2 for one in (u, v, w)) / 2
kz, ky, kx = (2 * np.pi * np.fft.fftfreq(n, d) for n, d in ((nz, dz), (ny, dy), (nx, dx)))
k = np.sqrt(kz[:, None, None] ** 2 + ky[None, :, None] ** 2 + kx[None, None, :] ** 2)
edges = np.geomspace(2 * np.pi / 120, 2 * np.pi / 30, 8)
middle = np.sqrt(edges[1:] * edges[:-1])
shells = np.array([energy[(k >= a) & (k < b)].sum() / (b - a) for a, b in zip(edges[:-1], edges[1:])])
slope = np.polyfit(np.log(middle), np.log(shells), 1)[0]

inside = (
    (np.roll(u, -1, 2) - u)[:-1] / dx + (np.roll(v, -1, 1) - v)[:-1] / dy + (w[1:] - w[:-1]) / dz
)
print(worst, slope, np.abs(inside).max() / np.abs((w[1:] - w[:-1]) / dz).max())
