//! # Files for other programs
//!
//! What to write, what to open, and where the fields are. Every format here is made of a firn::State, so it serves a
//! Simulation, a ParticleSystem and any mesh alike, and every series can be written in the background.
//!
//! | for | write | open | positions, velocities, other fields |
//! | --- | --- | --- | --- |
//! | ParaView | a StateSeries (HDF5) | `NAME.hdf.series` | points and triangles; all fields by their names; times |
//! | Blender, Houdini, Omniverse | a firn::UsdSeries | `NAME.usda` | `points`, `velocities`, `widths`, `ids`, `primvars:FIELD` |
//! | Blender, MeshLab, Python | a firn::PlySeries | `NAME_0000.ply`, … | `x y z`, `vx vy vz`, `id`, `FIELD` or `FIELD_x …` |
//! | renderers | `write_ply(path, firn::surface_of(…))` | `NAME.ply` | a closed surface, `nx ny nz`, fields: [States](07_states.cpp) |
//! | any program with meshes | a firn::ObjSeries | `NAME_0000.obj`, … | vertices and triangles only |
//! | viewers of splats | a firn::SplatSeries | `NAME_0000.ply`, … | a Gaussian for each particle, deformed as the particle |
//!
//! No header here is part of `firn/firn.hpp`; a program that needs no HDF5 includes none of `firn/io/states.hpp` but
//! `firn/io/simulation_state.hpp`. All lengths are in metres, and y is up.
#include <firn/firn.hpp>
#include <firn/io/joined_states.hpp>
#include <firn/io/obj_series.hpp>
#include <firn/io/ply_series.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/io/splat_series.hpp>
#include <firn/io/usd_series.hpp>
#include <firn/lagrangian/cloth.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

namespace {

/// A box of twelve triangles, from read_obj() in your program.
firn::TriangleMesh box(const firn::Vec<double, 3>& lower, const firn::Vec<double, 3>& upper) {
    firn::TriangleMesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.vertices.push_back({(k & 1 ? upper : lower)[0], (k & 2 ? upper : lower)[1], (k & 4 ? upper : lower)[2]});
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

}  // namespace

int main() {
    //! ## A run that writes all of them
    //!
    //! A block of jelly falls, and its surface moves along as a *skin*: a net of points of almost no mass, of the
    //! material firn::NoStress. So the mesh that was filled is the mesh that is drawn.
    const double h = 1.0 / 32;
    firn::Simulation simulation(
        firn::Domain<3>{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = h},
        firn::Materials{firn::FixedCorotated<float>::from_young_poisson(5e3, 0.3), firn::NoStress<float>{}});
    const firn::TriangleMesh mesh = box({0.4, 0.05, 0.4}, {0.6, 0.25, 0.6});
    simulation.set<0>().add(firn::sample_mesh(mesh, {.spacing = h / 2}), 1000);
    const auto skin = firn::cloth(mesh);
    simulation.set<1>().add(skin, std::vector<double>(skin.positions.size(), 1e-6));  // kg for each point

    //! `BackgroundSeries<float, SERIES>` writes while the simulation goes on; `SERIES` alone writes at once. Options follow
    //! the name. A colour may come from a field, here from the speed: 0 to 2 m/s.
    firn::BackgroundSeries<float, firn::UsdSeries> usd("out", "run", {.primvars = {"mass"}});
    firn::BackgroundSeries<float, firn::PlySeries> ply("out", "jelly", {.fields = {"velocity", "mass"}});
    firn::BackgroundSeries<float, firn::ObjSeries> obj("out", "skin");
    const auto of_speed = [](std::span<const double> v) {
        const double speed = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        return firn::Vec<double, 3>{std::min(speed / 2, 1.0), 0.3, 1 - std::min(speed / 2, 1.0)};
    };
    firn::BackgroundSeries<float, firn::SplatSeries> splats("out", "splats",
                                                            {.field = "velocity", .colour_of = of_speed});

    //! An output interval of 1/24 s makes each state a frame of the stage, whose time codes are 24 a second
    //! (UsdOptions::time_codes_per_second). A USD series takes one prim for each set; `spare()` gives back the memory of
    //! states that are on disk.
    constexpr int frames = 6;
    for (int frame = 0; frame <= frames; ++frame) {
        if (frame > 0) simulation.advance(1.0 / 24);
        const firn::State<float> jelly = firn::state_of(simulation.set<0>()),
                                 surface = firn::state_of(simulation.set<1>());
        auto prims = usd.spare();
        prims.resize(2);
        prims[0] = {"jelly", jelly};
        prims[1] = {"skin", surface};
        usd.write(std::move(prims));
        ply.write(firn::State<float>(jelly));
        splats.write(firn::State<float>(jelly));
        obj.write(firn::State<float>(surface));
    }
    usd.finish();  // throws if a file could not be written
    ply.finish();
    splats.finish();
    obj.finish();

    //! One file by itself needs no series: `write_usd`, `write_ply`, `write_splats` and `write_obj` take a path and a state.
    //! firn::joined makes one state of several sets, with the field `set`, and firn::state_of a state of any mesh, such
    //! as that of a collider:
    firn::write_ply("out/all.ply",
                    firn::joined(std::vector{firn::state_of(simulation.set<0>()), firn::state_of(simulation.set<1>())}),
                    {"velocity", "set"});
    firn::write_usd("out/floor.usda", firn::state_of(box({0, -0.1, 0}, {1, 0, 1})));

    const std::size_t written = firn::read_series(ply.path()).size();
    std::printf("%zu times of %zu particles, and a skin of %zu triangles\n", written,
                firn::state_of(simulation.set<0>()).size(), firn::read_obj("out/skin_0006.obj").triangles.size());

    //! ## ParaView
    //!
    //! Write states (HDF5) with a StateSeries: [States and restart](07_states.cpp). VTK's readers of PLY and OBJ read points
    //! and triangles of the files here, but no fields. ParaView opens `NAME.ply.series` with its times; it has no list of
    //! OBJ files, but opens numbered files as a series.
    //!
    //! ## Blender
    //!
    //! *File > Import > Universal Scene Description*, `out/run.usda`. Seen with Blender 4.5: the scene has the stage's
    //! frames and rate, points are an animated point cloud with the attributes `position`, `velocity` and `radius`, the
    //! skin is an animated mesh, also where its triangles change, and a primvar of one or three components is an attribute
    //! of that name; `ids` are not read. Blender rotates the stage, so that its z is up.
    //!
    //! A PLY file has `vx`, `vy`, `vz` and the other fields as attributes. Blender takes z as up: choose *Up: Y* and
    //! *Forward: −Z*. From OBJ files it drops points without triangles.
    //!
    //! ## Houdini
    //!
    //! Bring `out/run.usda` into Solaris with a Sublayer or Reference LOP. Its samples come from one file for each time by
    //! *value clips*, the way of Houdini's own Geometry Clip Sequence. All files must lie in one folder. This follows
    //! SideFX's documentation; Houdini itself was not tried.
    //!
    //! ## Omniverse, Unreal
    //!
    //! Both open `out/run.usda` with OpenUSD's library, with which firn's tests read every value of such stages and check
    //! that they comply. They were not tried themselves. Unreal shows meshes that change as geometry caches. Omniverse's
    //! converter for splats asks for `f_rest`: write with `.harmonics = 3`.
    //!
    //! ## Viewers of splats
    //!
    //! The files have the properties of the program of Kerbl et al. (2023), in its order, without view-dependent colour. The
    //! loaders of three.js and of SuperSplat (splat-transform) read them; three.js computes the covariances F Σ₀ Fᵀ of a
    //! test to 3.5e-7. The viewer SIBR reads only degree 3: `.harmonics = 3`. Scenes from photographs have y down, so where
    //! a viewer shows a run upside down, turn it by 180° about z.
    //!
    //! F is the field `deformation_gradient`: of plastic matter its elastic part. Water has no F, so its particles are balls.
    //!
    //! ## Python
    //!
    //! ```python
    //! from pxr import Usd                              # pip install usd-core
    //! stage = Usd.Stage.Open("out/run.usda")
    //! points = stage.GetPrimAtPath("/run/jelly").GetAttribute("points")
    //! for code in points.GetTimeSamples():
    //!     print(code / stage.GetTimeCodesPerSecond(), len(points.Get(code)))
    //! stage.Export("run.usdc")                         # one binary file, with all times
    //! import plyfile                                   # pip install plyfile
    //! print(plyfile.PlyData.read("out/jelly_0003.ply")["vertex"].data["vy"])
    //! import trimesh                                   # pip install trimesh
    //! print(trimesh.load("out/skin_0003.obj").area)
    //! ```
    //!
    //! States have more: `python3 examples/read_state.py FILE` prints what is in one.
    //!
    //! ## Which format
    //!
    //! - **USD** holds points and meshes of all times in one stage, but as text: a particle takes about 90 B for each
    //!   time. OpenUSD makes one binary file of it, of a quarter of the size: see `stage.Export` above. Between two times
    //!   USD interpolates arrays that keep their length; so where particles come and go, render the times that were
    //!   written.
    //! - **PLY** is the smallest: 28 B for each particle with its velocity in `float`; a splat takes 68 B.
    //! - Positions in USD and splats are `float`: some 1e-7 of the distance from the origin. PLY and OBJ keep `double`.
    //! - NaN is refused by its field and particle. HDF5 states hold it, to be examined.
    //! - If the disk is full or the program is killed, the files of the times before are whole, and a series names no other.
    //!   `go_on_from(time)` continues a series after a restart.
    //!
    //! A format of your own is a struct with one function: see firn::SeriesOf.
    const bool good = written == frames + 1 && std::filesystem::exists("out/run.usda") &&
                      std::filesystem::exists("out/run_0006.usda") && std::filesystem::exists("out/splats_0006.ply");
    return good ? 0 : 1;
}
