"""Prints the contents of a state: python3 read_state.py out/two_bunnies_0000.hdf (needs h5py)."""
import sys

try:
    import h5py
except ModuleNotFoundError:
    sys.exit("read_state.py needs h5py. Install it with pip install h5py, or python3-h5py on Debian and Ubuntu.")

with h5py.File(sys.argv[1]) as state:
    vtk = state["VTKHDF"]
    print({name: array[0] for name, array in vtk["FieldData"].items()}, dict(state["firn"].attrs))
    for name, field in [("position", vtk["Points"]), *vtk["PointData"].items()]:
        print(f"{name} [{field.attrs['unit'].decode()}] {field.dtype} {field.shape}")
    for group, parameters in state["firn/parameters"].items():
        for name, parameter in parameters.items():
            print(f"{group} {name} = {parameter[()]} {parameter.attrs['unit'].decode()}")
