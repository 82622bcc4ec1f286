/// \file A scene in a JSON file: what a simulation is made of (firn/any/json.hpp), and its bodies, sources, sinks, and
/// how solids move. The whole file is checked before the first step; a mistake is told with its line.
#pragma once

#include <firn/any/json.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/data/point_spacing.hpp>
#include <firn/data/sampling.hpp>
#include <firn/io/obj.hpp>
#include <firn/simulation/source.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace example {

/// A solid whose surface is a closed mesh.
using MeshSolid = firn::Collider<firn::DistanceGrid<double, 3>>;
/// Velocities that a part of the boundary has from a time on.
struct Motion {
    std::size_t part;  ///< index in the boundary
    double time;       ///< [s]
    firn::Vec<double, 3> linear_velocity, angular_velocity;
};
struct SceneBody {
    std::size_t material;
    firn::Samples<3> samples;
    double density;
    firn::Vec<double, 3> velocity;
};
struct SceneSource {
    std::size_t material;
    firn::Source<3> source;
};
struct SceneSink {
    std::size_t material;
    firn::Sink<3> sink;
};
struct Scene {
    firn::SimulationChoice<3> choice;
    double spacing;  ///< of particles [m]
    std::vector<SceneBody> bodies;
    std::vector<SceneSource> sources;
    std::vector<SceneSink> sinks;
    std::vector<Motion> motions;  ///< in the order of time
    /// Of solids that are meshes, in the order of the boundary: the mesh in the coordinates of the solid.
    std::vector<firn::TriangleMesh> meshes;
    double end;           ///< [s]
    std::int64_t frames;  ///< states after the first one
};

/// Reads scenes. Files that a scene names lie beside it.
class SceneReader {
public:
    /// \param scale  factor of the sizes of cells and of the spacing
    SceneReader(std::filesystem::path folder, double scale) : folder_(std::move(folder)), scale_(scale) {}

    Scene read(const firn::JsonValue& json) {
        Scene scene;
        scene.choice = firn::read_choice<3>(
            json, {"$schema", "about", "spacing", "pattern", "bodies", "sources", "sinks", "motions", "end", "frames"},
            {{"mesh", [&](const firn::JsonValue& one, const firn::Domain<3>& domain) {
                  auto [solid, mesh] = solid_of(one, domain.cell_size * scale_);
                  scene.meshes.push_back(std::move(mesh));
                  return solid;
              }}});
        scene.choice.domain.cell_size *= scale_;
        scene.spacing = scene.choice.domain.cell_size / 2;  // 8 particles a cell
        if (const auto* spacing = json.find("spacing")) scene.spacing = scale_ * positive(*spacing);
        filling_.spacing = scene.spacing;
        if (const auto* pattern = json.find("pattern")) filling_.pattern = read_pattern(*pattern);
        const auto& choice = scene.choice;
        for_each(json, "bodies", [&](const firn::JsonValue& one) {
            one.allow({"material", "shape", "lower", "upper", "centre", "radius", "file", "size", "rotation",
                       "position", "density", "velocity"});
            scene.bodies.push_back({material_of(one, choice), samples_of(one), density_of(one), velocity_of(one)});
            check_inside(one, scene.bodies.back().samples, choice.domain);
        });
        for_each(json, "sources", [&](const firn::JsonValue& one) {
            one.allow({"material", "shape", "lower", "upper", "centre", "radius", "file", "size", "rotation",
                       "position", "density", "velocity", "rate", "start", "end", "lifespan"});
            firn::Source<3> source{
                .samples = samples_of(one), .density = density_of(one), .velocity = velocity_of(one)};
            if (const auto* rate = one.find("rate"))
                source.rate = rate->number();
            else
                source.rate = firn::norm(source.velocity) / scene.spacing;  // a jet without gaps
            if (const auto* start = one.find("start")) source.start = start->number();
            if (const auto* end = one.find("end")) source.end = end->number();
            if (const auto* lifespan = one.find("lifespan")) source.lifespan = lifespan->number();
            one.checked([&] { source.check(); });
            check_inside(one, source.samples, choice.domain);
            scene.sources.push_back({material_of(one, choice), source});
        });
        for_each(json, "sinks", [&](const firn::JsonValue& one) {
            one.allow({"material", "lower", "upper"});
            const firn::Sink<3> sink{one.at("lower").vector<3>(), one.at("upper").vector<3>()};
            one.checked([&] { sink.check(); });
            scene.sinks.push_back({material_of(one, choice), sink});
        });
        for_each(json, "motions", [&](const firn::JsonValue& one) {
            const Motion motion = motion_of(one, choice);
            const auto later = std::upper_bound(scene.motions.begin(), scene.motions.end(), motion.time,
                                                [](double time, const Motion& other) { return time < other.time; });
            scene.motions.insert(later, motion);
        });
        scene.end = positive(json.at("end"));
        scene.frames = 50;
        if (const auto* frames = json.find("frames")) scene.frames = std::int64_t(frames->whole());
        if (scene.frames < 1 || scene.frames > 100'000) json.at("frames").fail("give 1 to 100000 states");
        if (scene.bodies.empty() && scene.sources.empty()) json.fail("the scene has neither bodies nor sources");
        return scene;
    }

private:
    static double positive(const firn::JsonValue& json) {
        if (!(json.number() > 0)) json.fail("give a number above 0");
        return json.number();
    }
    template <class F>
    static void for_each(const firn::JsonValue& json, const char* name, const F& f) {
        if (const auto* list = json.find(name))
            for (const firn::JsonValue& one : list->array()) f(one);
    }
    static firn::Pattern read_pattern(const firn::JsonValue& json) {
        if (json.text() == "lattice") return firn::Pattern::lattice;
        if (json.text() == "jittered") return firn::Pattern::jittered;
        if (json.text() == "poisson_disk") return firn::Pattern::poisson_disk;
        json.fail("give \"lattice\", \"jittered\" or \"poisson_disk\"");
    }
    /// Which material a body has; it need not say so if there is only one.
    static std::size_t material_of(const firn::JsonValue& json, const firn::SimulationChoice<3>& choice) {
        const auto* name = json.find("material");
        if (!name && choice.materials.size() == 1) return 0;
        if (!name) json.fail("'material' is missing");
        std::vector<std::string> names;
        for (std::size_t k = 0; k < choice.materials.size(); ++k) {
            names.push_back(choice.materials[k].name);
            if (names.back() == name->text()) return k;
        }
        name->fail(firn::sentence("the scene has no such material; there are: ", firn::detail::listed_names(names)));
    }
    static double density_of(const firn::JsonValue& json) { return positive(json.at("density")); }
    static firn::Vec<double, 3> velocity_of(const firn::JsonValue& json) {
        const auto* velocity = json.find("velocity");
        return velocity ? velocity->vector<3>() : firn::Vec<double, 3>{};
    }
    firn::Samples<3> samples_of(const firn::JsonValue& json) const {
        const firn::JsonValue& shape = json.at("shape");
        if (shape.text() == "box") {
            const auto lower = json.at("lower").vector<3>(), upper = json.at("upper").vector<3>();
            return filled(json, [&] { return firn::sample_box<3>(lower, upper, filling_); });
        }
        if (shape.text() == "ball") {
            const auto centre = json.at("centre").vector<3>();
            const double radius = positive(json.at("radius"));
            return filled(json, [&] { return firn::sample_sphere<3>(centre, radius, filling_); });
        }
        if (shape.text() == "mesh") return filled(json, [&] { return firn::sample_mesh(mesh_of(json), filling_); });
        if (shape.text() == "points") return filled(json, [&] { return points_of(json); });
        shape.fail("give \"box\", \"ball\", \"mesh\" or \"points\"");
    }
    template <class F>
    static firn::Samples<3> filled(const firn::JsonValue& json, const F& fill) {
        firn::Samples<3> samples = json.checked(fill);
        if (samples.positions.empty())
            json.fail("no particle fits into the body; make it larger or the spacing smaller");
        return samples;
    }
    [[nodiscard]] std::filesystem::path file_of(const firn::JsonValue& json) const {
        const firn::JsonValue& file = json.at("file");
        const std::filesystem::path path = folder_ / file.text();
        if (!std::filesystem::exists(path)) file.fail(firn::sentence("there is no file ", path));
        return path;
    }
    /// The mesh of a file, turned, and where it is to be: its middle, the longest side of its box, how it was turned.
    struct PlacedMesh {
        firn::TriangleMesh mesh;
        firn::Vec<double, 3> middle;
        double size;
        firn::Rotor<double, 3> rotation;
    };
    [[nodiscard]] PlacedMesh placed_mesh(const firn::JsonValue& json) const {
        PlacedMesh placed{firn::read_obj(file_of(json)), {}, 0, firn::no_rotation<double, 3>()};
        if (const auto* turn = json.find("rotation")) {
            placed.rotation = firn::detail::read_turn<firn::Rotor<double, 3>>(*turn);
            if (turn->is(firn::JsonValue::Kind::array)) {
                const double length = norm(placed.rotation);
                if (!(std::abs(length - 1) < 1e-6)) turn->fail("give a quaternion of length 1, or an axis and degrees");
                placed.rotation = placed.rotation * (1 / length);  // it was written with a few digits
            }
            placed.mesh = firn::rotated(placed.mesh, matrix_of(placed.rotation), firn::Vec<double, 3>{});
        }
        const auto box = firn::bounding_box(placed.mesh);
        const auto extent = box.upper - box.lower;
        placed.size = std::max({extent[0], extent[1], extent[2]});
        placed.middle = (box.lower + box.upper) * 0.5;
        if (const auto* given = json.find("size")) placed.size = positive(*given);
        if (const auto* position = json.find("position")) placed.middle = position->vector<3>();
        return placed;
    }
    [[nodiscard]] firn::TriangleMesh mesh_of(const firn::JsonValue& json) const {
        const PlacedMesh placed = placed_mesh(json);
        return firn::fitted(placed.mesh, placed.middle, placed.size);
    }
    /// A solid where a body with the same members would be, which turns about the middle of its mesh; and this mesh, in
    /// the coordinates of the solid.
    [[nodiscard]] std::pair<MeshSolid, firn::TriangleMesh> solid_of(const firn::JsonValue& json,
                                                                    double cell_size) const {
        firn::TriangleMesh mesh;
        const auto complete = [&](MeshSolid& solid) {
            const PlacedMesh placed = placed_mesh(json);
            solid.position = placed.middle;
            solid.rotation = placed.rotation;
            mesh = firn::rotated(firn::fitted(placed.mesh, {}, placed.size), transpose(matrix_of(placed.rotation)));
            // Contact looks at distances in the layer and up to two cells beyond it; there they are to be exact.
            const double layer = solid.thickness + solid.thickness_in_cells * cell_size;
            solid.shape.numbers =
                firn::mesh_distance(mesh, {.spacing = 0.5 * cell_size, .band = std::max(layer, 0.0) + 2 * cell_size});
        };
        return {firn::read_collider<firn::DistanceGrid<double, 3>>(json, {"file", "size"}, complete), std::move(mesh)};
    }
    /// The vertices of a file as particles, as they are.
    [[nodiscard]] firn::Samples<3> points_of(const firn::JsonValue& json) const {
        for (const char* const name : {"size", "rotation", "position"})
            if (const auto* one = json.find(name)) one->fail("points are taken as they are");
        firn::Samples<3> samples{firn::read_obj_points(file_of(json)), 0};
        samples.volume = std::pow(firn::point_spacing(samples.positions), 3);
        return samples;
    }
    static void check_inside(const firn::JsonValue& json, const firn::Samples<3>& samples,
                             const firn::Domain<3>& domain) {
        for (const auto& x : samples.positions)
            for (int a = 0; a < 3; ++a)
                if (!(x[a] >= domain.lower[a] && x[a] <= domain.upper[a]))
                    json.fail(firn::sentence("a particle at ", x[a], " m along axis ", a,
                                             " lies outside of the domain, ", domain.lower[a], " m to ",
                                             domain.upper[a], " m"));
    }
    static Motion motion_of(const firn::JsonValue& json, const firn::SimulationChoice<3>& choice) {
        json.allow({"part", "time", "linear_velocity", "angular_velocity"});
        Motion motion{std::size_t(json.at("part").whole()), json.at("time").number(), {}, {}};
        const std::size_t parts = choice.boundary ? choice.boundary->size() : 0;
        if (motion.part >= parts || (*choice.boundary)[motion.part].index() == 0)
            json.at("part").fail(firn::sentence(
                "part ", motion.part, " of the boundary is no solid that moves; it has ", parts, " parts, from 0"));
        if (!(motion.time >= 0)) json.at("time").fail("a time is not negative");
        if (const auto* v = json.find("linear_velocity")) motion.linear_velocity = v->vector<3>();
        if (const auto* w = json.find("angular_velocity")) motion.angular_velocity = w->vector<3>();
        return motion;
    }

    std::filesystem::path folder_;
    double scale_;
    firn::SamplingOptions filling_{.spacing = 0, .pattern = firn::Pattern::jittered};
};

/// Reads a scene from a file.
/// \param particles  about how many the bodies are to have; 0: as many as the file says. Cells and spacing follow.
/// \throws firn::io_error  if the file cannot be read or has a mistake; the message has its name and the line
inline Scene read_scene(const std::filesystem::path& file, std::int64_t particles) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw firn::io_error(firn::sentence("The scene ", file, " cannot be opened. Give a file that exists."));
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    try {
        const auto json = firn::JsonValue::parse(text);
        Scene scene = SceneReader(file.parent_path(), 1).read(json);
        std::size_t count = 0;
        for (const SceneBody& body : scene.bodies) count += body.samples.positions.size();
        if (particles == 0 || count == 0) return scene;
        return SceneReader(file.parent_path(), std::cbrt(double(count) / double(particles))).read(json);
    } catch (const firn::io_error& mistake) {
        throw firn::io_error(firn::sentence(file, ": ", mistake.what()));
    }
}

}  // namespace example
