"""Prints the contents of a state: python3 read_state.py out/two_bunnies_0000.hdf (needs h5py)."""
import sys

try:
    import h5py
except ImportError as problem:
    sys.exit(f"read_state.py needs h5py ({problem}). Install it with pip install h5py, or python3-h5py on Debian and "
             "Ubuntu.")


def print_state(state):
    vtk = state["VTKHDF"]
    print({name: array[0] for name, array in vtk["FieldData"].items()}, dict(state["firn"].attrs))
    for name, field in [("position", vtk["Points"]), *vtk["PointData"].items()]:
        print(f"{name} [{field.attrs['unit'].decode()}] {field.dtype} {field.shape}")
    for group, parameters in state["firn/parameters"].items():
        for name, parameter in parameters.items():
            print(f"{group} {name} = {parameter[()]} {parameter.attrs['unit'].decode()}")
    if "parameter_list" in state["firn"]:  # more than 512 parameters, as of many colliders
        texts, counts, values = (state["firn/parameter_list"][name][()] for name in ("texts", "counts", "values"))
        words, first = texts.tobytes().decode().split("\0"), 0
        for group, name, unit, count in zip(words[0::3], words[1::3], words[2::3], counts):
            print(f"{group} {name} = {values[first:first + count]} {unit}")
            first += count


if len(sys.argv) != 2:
    sys.exit("Give one state to print, such as: python3 read_state.py out/two_bunnies_0000.hdf")
try:
    with h5py.File(sys.argv[1]) as file:
        print_state(file)
except (OSError, KeyError) as problem:
    sys.exit(f"{sys.argv[1]} is not a state that firn has written: {problem}")
