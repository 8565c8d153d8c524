# Readers of the NetCDF files, for tests/it/products/netcdf.rs: run in the folder of the files.
import numpy as np


def near(found, wanted, tolerance):
    found, wanted = np.asarray(found, float), np.asarray(wanted, float)
    assert (np.isnan(found) == np.isnan(wanted)).all(), "other values are missing"
    assert np.nanmax(np.abs(found - wanted), initial=0.0) <= tolerance


def drones():
    import netCDF4, pandas, xarray

    table = pandas.read_csv("updraft.csv", parse_dates=["utc"])
    table = table[table.utc.notna() & table.latitude_deg.notna()].reset_index()
    file = xarray.open_dataset("updraft.nc")
    assert file.sizes["obs"] == len(table)
    assert (file.time.values == table.utc.dt.tz_localize(None).values.astype("datetime64[ns]")).mean() > 0.95
    late = file.time.values - table.utc.dt.tz_localize(None).values.astype("datetime64[ns]")
    assert np.abs(late).max() < np.timedelta64(1, "us")
    for name, column in [
        ("w", "w_mps"), ("w_se", "w_se_mps"), ("w_posterior", "posterior_mps"), ("w_true", "truth_mps"),
        ("w_posterior_se", "posterior_sd_mps"), ("u", "u_mps"), ("u_se", "u_se_mps"), ("v", "v_mps"),
        ("v_se", "v_se_mps"),
    ]:
        near(file[name], table[column], 6e-5)
    near(file.lat, table.latitude_deg, 6e-8)
    near(file.lon, table.longitude_deg, 6e-8)
    near(file.height, table.height_agl_m, 0.0051)
    near(file.alt, table.altitude_amsl_m, 0.0051)
    near(file.show_time, table.time_s, 1e-9)
    bits = dict(zip(file.w_flag.flag_meanings.split(), file.w_flag.flag_masks))
    wanted = [sum(bits[flag] for flag in flags.split(";")) for flags in table["flags"].fillna("gap").replace("", "gap")]
    empty = table["flags"].isna() | (table["flags"] == "")
    assert (file.w_flag.values == np.where(empty, 0, wanted)).all()
    assert set(np.unique(file.w_flag)) >= {0, bits["drift"], bits["drift"] | bits["no_voltage"], bits["filled"]}

    # One trajectory for each drone, one after the other; the checker does not look at this.
    raw = netCDF4.Dataset("updraft.nc")
    assert raw["row_size"].sample_dimension == "obs"
    assert raw["row_size"].dimensions == ("trajectory",)
    assert file.row_size.sum() == file.sizes["obs"]
    assert (np.repeat(np.arange(file.sizes["trajectory"]), file.row_size) == file.trajectory_index).all()
    names = table.flight + "/" + table.drone
    assert (file.trajectory_id.values[file.trajectory_index] == names.values).all()
    assert (file.slot.values[file.trajectory_index] == table.slot.values).all()
    assert (file.place_by.values[file.trajectory_index] == table.place_by.values).all()
    for name in raw.variables:
        for other in getattr(raw[name], "ancillary_variables", "").split():
            assert raw[other].dimensions == raw[name].dimensions
        for other in getattr(raw[name], "coordinates", "").split():
            assert raw[other].dimensions == ("obs",)
    assert raw["time_bounds"][0].tolist() == [raw["time"][0] - 5, raw["time"][0] + 5]
    assert raw.inputs.endswith("  hover/plan.json") and raw.inputs_count == 2
    assert raw.institution.endswith('"Air" & <Weather>')
    print("rows", len(table))


def grid():
    import pandas, xarray

    table = pandas.read_csv("updraft-grid.csv", parse_dates=["utc"])
    file = xarray.open_dataset("updraft-grid.nc")
    assert file.w.dims == ("time", "z", "y", "x")
    assert int(file.w.notnull().sum()) == len(table)
    for row in table.itertuples():
        cell = file.sel(time=row.utc.tz_localize(None), z=row.z_m)
        off = np.hypot(cell.lat - row.latitude_deg, cell.lon - row.longitude_deg)
        here = cell.isel(off.argmin(["y", "x"]))
        assert float(off.min()) < 1e-7
        near(here.w, row.w_mps, 6e-5)
        near(here.w_se, row.sd_mps, 6e-5)
        near(here.u, row.u_mps, 6e-4)
        near(here.v_se, row.v_se_mps, 6e-4)
        assert float(here.show_time) == row.time_s
    for axis in ("x", "y"):
        assert (np.diff(file[axis]) > 0).all()
    print("cells", len(table))


def projection(orientation_deg):
    import pyproj, xarray

    file = xarray.open_dataset("updraft-grid.nc")
    crs = pyproj.CRS.from_cf(file.crs.attrs)
    if orientation_deg % 90 == 0:
        assert file.crs.grid_mapping_name == "transverse_mercator"
    to_deg = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    x, y = np.meshgrid(file.x, file.y)
    lon, lat = to_deg.transform(x, y)
    # A centimetre.
    near(lat, file.lat, 1e-7)
    near(lon, file.lon, 1e-7)
    print("projected", lat.size)


def turbulence():
    import netCDF4, pandas, xarray

    file = xarray.open_dataset("turbulence.nc")
    table = pandas.read_csv("turbulence.csv")
    table = table[table.drone.notna() | table.quantity.notna()]
    fleet = table[table.drone.isna()]
    for row in fleet.itertuples():
        for end, value in (("", row.value), ("_low", row.low), ("_high", row.high)):
            if not np.isnan(value):
                found = float(file[row.quantity + end])
                assert abs(found - value) <= max(6e-6, 1e-3 * abs(value)), (row.quantity, end, found, value)
        assert file[row.quantity].units == ("1" if row.unit == "standard deviations" else row.unit)
    drones = table[table.drone.notna()]
    for row in drones.itertuples():
        own = file.isel(drone=list(file.drone_name.values).index(row.drone))
        near(own["drone_" + row.quantity], row.value, 6e-6)
    spectra = pandas.read_csv("turbulence-spectra.csv")
    for name in ("w", "u", "v", "uw"):
        own = spectra[spectra.drone.isna() & (spectra.component == name)]
        assert file.sizes["frequency_" + name] == len(own) > 0
        near(file["frequency_" + name], own.frequency_hz, 6e-6)
        for end, column in (("", "density_m2ps2phz"), ("_low", "low_m2ps2phz"), ("_high", "high_m2ps2phz")):
            assert np.allclose(file["spectrum_" + name + end], own[column], rtol=1e-3, atol=6e-6)
    first = file.drone_name.values[0]
    own = spectra[spectra.drone == first]
    count = int(file.drone_spectrum_w[0].notnull().sum())
    assert count == len(own) > 0
    assert np.allclose(file.drone_spectrum_w[0, :count], own.density_m2ps2phz, rtol=1e-3, atol=6e-6)
    pairs = pandas.read_csv("turbulence-pairs.csv")
    for row in pairs.itertuples():
        at = file.isel(distance=int(np.abs(file.distance.values - row.distance_m).argmin()))
        # At no lag the table has what the records' means took away; the covariance by lag has it nowhere.
        by_lag = at.covariance_w_by_lag.sel(lag=row.lag_s)
        near(at.covariance_w if row.lag_s == 0 else by_lag, row.covariance_m2ps2, 6e-6)
        assert int(at.pairs) == row.pairs
    coherence = pandas.read_csv("turbulence-coherence.csv")
    assert int(file.squared_coherence.notnull().sum()) == len(coherence)
    raw = netCDF4.Dataset("turbulence.nc")
    for name in raw.variables:
        for other in getattr(raw[name], "ancillary_variables", "").split():
            assert raw[other].dimensions == raw[name].dimensions
        for other in getattr(raw[name], "coordinates", "").split():
            assert other in raw.variables
    from_s, to_s = float(raw["time_begin"][...]), float(raw["time_end"][...])
    assert to_s - from_s > 60 and float(raw["time"][...]) == 0.5 * (from_s + to_s)
    print("quantities", len(fleet))


def complies(path):
    from compliance_checker.runner import CheckSuite, ComplianceChecker

    CheckSuite.load_all_available_checkers()
    ComplianceChecker.run_checker(path, ["cf:1.11"], 0, "strict")
