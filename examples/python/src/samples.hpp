/// \file Points that fill a shape, and meshes, with NumPy arrays.
#pragma once

#include <firn/data/sampling.hpp>
#include <firn/io/obj.hpp>

#include "arrays.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <variant>

namespace python {

/// The particles that fill a shape of two or three dimensions.
struct AnySamples {
    std::variant<firn::Samples<2>, firn::Samples<3>> samples;

    /// Makes samples of points. \param volume  of each [m^D]
    AnySamples(const Array<const double>& points, double volume) {
        if (points.ndim() == 2 && points.shape(1) == 2)
            samples = made<2>(points, volume);
        else if (points.ndim() == 2 && points.shape(1) == 3)
            samples = made<3>(points, volume);
        else
            throw firn::parameter_error("Points are an array of n rows of 2 or 3 numbers.");
    }
    template <int D>
    explicit AnySamples(firn::Samples<D> of) : samples(std::move(of)) {}

    static nb::object positions(nb::handle self) {
        return std::visit(
            [&]<int D>(firn::Samples<D>& of) {
                static_assert(sizeof(firn::Vec<double, D>) == D * sizeof(double));
                double* const first = of.positions.empty() ? nullptr : of.positions.data()->v;
                return view_of(first, {of.positions.size(), std::size_t(D)}, self);
            },
            nb::cast<AnySamples&>(self).samples);
    }
    double volume() const {
        return std::visit([](const auto& of) { return of.volume; }, samples);
    }
    std::size_t size() const {
        return std::visit([](const auto& of) { return of.positions.size(); }, samples);
    }

private:
    template <int D>
    static firn::Samples<D> made(const Array<const double>& points, double volume) {
        firn::Samples<D> samples;
        samples.volume = volume;
        samples.positions.resize(points.shape(0));
        if (points.size() > 0) std::memcpy(samples.positions.data(), points.data(), points.size() * sizeof(double));
        return samples;
    }
};

inline firn::SamplingOptions filling(double spacing, const std::string& pattern, double jitter, std::uint64_t seed) {
    firn::SamplingOptions options{.spacing = spacing, .jitter = jitter, .seed = seed};
    if (pattern == "jittered")
        options.pattern = firn::Pattern::jittered;
    else if (pattern == "poisson_disk")
        options.pattern = firn::Pattern::poisson_disk;
    else if (pattern != "lattice")
        throw firn::parameter_error(
            firn::sentence("There is no pattern '", pattern, "'; there are: lattice, jittered, poisson_disk."));
    return options;
}

inline nb::tuple arrays_of(const firn::TriangleMesh& mesh) {
    const auto copy = []<class T, class Row>(const std::vector<Row>& rows, std::type_identity<T>) {
        static_assert(sizeof(Row) == 3 * sizeof(T));
        std::unique_ptr<T[]> data(new T[3 * rows.size()]);
        if (!rows.empty()) std::memcpy(data.get(), rows.data(), rows.size() * sizeof(Row));
        return array_of(std::move(data), {rows.size(), 3});
    };
    return nb::make_tuple(copy(mesh.vertices, std::type_identity<double>{}),
                          copy(mesh.triangles, std::type_identity<std::int32_t>{}));
}

inline firn::TriangleMesh mesh_of(const Array<const double>& vertices, const Array<const std::int32_t>& triangles) {
    if (vertices.ndim() != 2 || vertices.shape(1) != 3 || triangles.ndim() != 2 || triangles.shape(1) != 3)
        throw firn::mesh_error("A mesh is an array of n vertices of 3 numbers and one of m triangles of 3 indices.");
    firn::TriangleMesh mesh;
    mesh.vertices.resize(vertices.shape(0));
    mesh.triangles.resize(triangles.shape(0));
    if (vertices.size() > 0) std::memcpy(mesh.vertices.data(), vertices.data(), vertices.size() * sizeof(double));
    if (triangles.size() > 0)
        std::memcpy(mesh.triangles.data(), triangles.data(), triangles.size() * sizeof(std::int32_t));
    return mesh;
}

inline void bind_samples(nb::module_& module) {
    using namespace nb::literals;
    using Unlocked = nb::call_guard<nb::gil_scoped_release>;
    nb::class_<AnySamples>(module, "Samples", "Points that fill a shape, each with the same volume.")
        .def(nb::init<const Array<const double>&, double>(), "positions"_a, "volume"_a,
             "Takes points [m], an array of n rows of 2 or 3 numbers, each of this volume [m^D].")
        .def_prop_ro(
            "positions", [](nb::handle self) { return AnySamples::positions(self); },
            nb::sig("def positions(self) -> numpy.ndarray"), "The points [m], n rows: a view, which may be written to.")
        .def_prop_ro("volume", &AnySamples::volume, "The volume of each point [m^D].")
        .def("__len__", &AnySamples::size);

    module.def(
        "sample_box",
        [](const Numbers& lower, const Numbers& upper, double spacing, const std::string& pattern, double jitter,
           std::uint64_t seed) {
            const auto options = filling(spacing, pattern, jitter, seed);
            if (lower.size() == 2)
                return AnySamples(
                    firn::sample_box(vector_of<2>(lower, "lower"), vector_of<2>(upper, "upper"), options));
            return AnySamples(firn::sample_box(vector_of<3>(lower, "lower"), vector_of<3>(upper, "upper"), options));
        },
        "lower"_a, "upper"_a, nb::kw_only(), "spacing"_a, "pattern"_a = "lattice", "jitter"_a = 0.25, "seed"_a = 1,
        Unlocked(), "Fills a box (in 2D: a rectangle) from `lower` to `upper` [m], one point per spacing^D.");
    module.def(
        "sample_sphere",
        [](const Numbers& centre, double radius, double spacing, const std::string& pattern, double jitter,
           std::uint64_t seed) {
            const auto options = filling(spacing, pattern, jitter, seed);
            if (centre.size() == 2)
                return AnySamples(firn::sample_sphere(vector_of<2>(centre, "centre"), radius, options));
            return AnySamples(firn::sample_sphere(vector_of<3>(centre, "centre"), radius, options));
        },
        "centre"_a, "radius"_a, nb::kw_only(), "spacing"_a, "pattern"_a = "lattice", "jitter"_a = 0.25, "seed"_a = 1,
        Unlocked(), "Fills a ball (in 2D: a disk) of a centre and a radius [m].");
    module.def(
        "sample_mesh",
        [](const Array<const double>& vertices, const Array<const std::int32_t>& triangles, double spacing,
           const std::string& pattern, double jitter, std::uint64_t seed) {
            return AnySamples(firn::sample_mesh(mesh_of(vertices, triangles), filling(spacing, pattern, jitter, seed)));
        },
        "vertices"_a, "triangles"_a, nb::kw_only(), "spacing"_a, "pattern"_a = "lattice", "jitter"_a = 0.25,
        "seed"_a = 1, Unlocked(), "Fills a closed mesh: vertices [m], and triangles as indices from 0.");
    module.def(
        "fitted",
        [](const Array<const double>& vertices, const Array<const std::int32_t>& triangles, const Numbers& centre,
           double size) {
            return arrays_of(firn::fitted(mesh_of(vertices, triangles), vector_of<3>(centre, "centre"), size));
        },
        "vertices"_a, "triangles"_a, "centre"_a, "size"_a,
        nb::sig(
            "def fitted(vertices: numpy.ndarray, triangles: numpy.ndarray, centre: collections.abc.Sequence[float], "
            "size: float) -> tuple[numpy.ndarray, numpy.ndarray]"),
        "Returns a mesh scaled and moved so that its longest edge is `size` and its middle `centre` [m].");
    module.def(
        "rotated",
        [](const Array<const double>& vertices, const Array<const std::int32_t>& triangles, const Numbers& axis,
           double degrees) {
            const auto turn = firn::rotor(vector_of<3>(axis, "axis"), firn::degrees(degrees));
            return arrays_of(firn::rotated(mesh_of(vertices, triangles), matrix_of(turn)));
        },
        "vertices"_a, "triangles"_a, "axis"_a, "degrees"_a,
        nb::sig("def rotated(vertices: numpy.ndarray, triangles: numpy.ndarray, axis: collections.abc.Sequence[float], "
                "degrees: float) -> tuple[numpy.ndarray, numpy.ndarray]"),
        "Returns a mesh turned about an axis through the origin, by the right-hand rule.");
    module.def(
        "read_obj", [](const std::filesystem::path& path) { return arrays_of(firn::read_obj(path)); }, "path"_a,
        nb::sig("def read_obj(path: str | os.PathLike) -> tuple[numpy.ndarray, numpy.ndarray]"),
        "Reads an OBJ file: the vertices [m] and the triangles, as indices from 0.");
}

}  // namespace python
