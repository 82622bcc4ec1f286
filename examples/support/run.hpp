/// \file Runs a simulation in an example: steps, a progress bar, HDF5 states, OBJ files and a picture.
#pragma once

#include "support/run_schedule.hpp"
#include "support/solids.hpp"
#include <firn/firn.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/ply.hpp>
#include <firn/io/states.hpp>

#include <algorithm>
#include <limits>
#include <memory>

namespace example {

/// Returns the positions of a material's particles [m], in the order of ids.
template <std::size_t I = 0, class Simulation>
std::vector<firn::Vec<double, Simulation::dimension>> positions(const Simulation& simulation) {
    const auto& particles = simulation.template set<I>().particles();
    std::vector<std::size_t> slots;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) slots.push_back(slot);
    std::sort(slots.begin(), slots.end(), [&](auto a, auto b) { return particles.id(a) < particles.id(b); });
    std::vector<firn::Vec<double, Simulation::dimension>> points;
    for (const std::size_t slot : slots) points.push_back(firn::cast<double>(particles.position(slot)));
    return points;
}

/// Calls f(number) for each material of the simulation. The number is a compile-time constant.
template <class Simulation, class F>
void for_materials(const F& f) {
    firn::unroll<int(Simulation::material_count)>(
        [&](auto i) { f(std::integral_constant<std::size_t, std::size_t(i)>{}); });
}

/// The colours of a picture, and what it shows besides the particles, such as surfaces of solids.
template <int D>
struct Scenery {
    std::vector<firn::Vec<double, D>> points{};
    Colour solid = slate;  ///< colour of the points
    std::vector<Colour>
        colours{};      ///< of materials, or of bodies if there is one material; if empty, in the palette's order
    Surface surface{};  ///< triangles, such as of add_mesh()
};

/// Adds the nets of a simulation's I-th material as surfaces of one colour.
template <std::size_t I, class Simulation>
void add_nets(Surface& surface, const Simulation& simulation, std::uint8_t colour) {
    const auto& particles = simulation.template set<I>().particles();
    const std::size_t first = surface.vertices.size();
    constexpr float gone = std::numeric_limits<float>::quiet_NaN();  // its triangles are not drawn
    surface.vertices.resize(first + particles.next_id(), {gone, gone, gone});
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) surface.vertices[first + particles.id(slot)] = drawn(particles.position(slot));
    for (auto facet : simulation.template set<I>().facets()) {
        for (auto& corner : facet) corner += std::uint32_t(first);
        add_triangle(surface, facet, colour);
    }
}

/// Returns all particles as a cloud, with nets as surfaces. Each material has its own colour or, if there is only one,
/// each body.
template <class Simulation>
Cloud cloud_of(const Simulation& simulation, double spacing, const Scenery<Simulation::dimension>& scenery = {}) {
    constexpr int D = Simulation::dimension;
    Cloud cloud;
    cloud.surface = scenery.surface;
    cloud.radius = float((D == 3 ? 0.6 : 0.75) * spacing);
    const auto add = [&](const firn::Vec<double, D>& x, std::uint8_t colour, Look look, const Mat3& shape) {
        cloud.positions.push_back(drawn(x));
        cloud.colour.push_back(colour);
        cloud.look.push_back(look);
        cloud.shape.push_back(shape);
    };
    for_materials<Simulation>([&](auto i) {
        const auto& particles = simulation.template set<i>().particles();
        const auto& bodies = simulation.template set<i>().bodies();
        constexpr bool deforms = requires { particles.state(0).F; };
        const Look look =
            look_of(std::remove_cvref_t<decltype(simulation.template set<i>().material())>::name, deforms);
        const auto colour_of = [&](std::size_t number) {
            return number < scenery.colours.size() ? std::uint8_t(scenery.colours[number]) : std::uint8_t(number);
        };
        if constexpr (D == 3) {
            if (!simulation.template set<i>().facets().empty()) {
                add_nets<i>(cloud.surface, simulation, colour_of(std::size_t(i)));
                return;
            }
        }
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const auto next = std::upper_bound(bodies.begin(), bodies.end(), particles.id(slot),
                                               [](auto id, const firn::Body& body) { return id < body.first; });
            const std::size_t number =
                Simulation::material_count > 1 ? std::size_t(i) : std::size_t(next - bodies.begin() - 1);
            Mat3 shape = Mat3::identity();
            if constexpr (D == 3 && deforms) shape = firn::cast<float>(particles.state(slot).F);
            add(firn::cast<double>(particles.position(slot)), colour_of(number), look, shape);
        }
    });
    for (const auto& x : scenery.points) add(x, scenery.solid, Look::ball, Mat3::identity());
    return cloud;
}

/// Draws the particles.
template <class Simulation>
Image picture(const Simulation& simulation, double spacing, View view = {},
              const Scenery<Simulation::dimension>& scenery = {}) {
    constexpr int D = Simulation::dimension;
    const auto& domain = simulation.domain();
    Box box;
    for (int a = 0; a < 3; ++a) {
        box.lower[a] = a < D ? float(domain.lower[a]) : 0.0F;
        box.upper[a] = a < D ? float(domain.upper[a]) : 0.0F;
    }
    view.domain = box;
    return render(cloud_of(simulation, spacing, scenery), view);
}

/// Writes the states of a run as OUTPUT/NAME_0000.hdf …; with several materials, as OUTPUT/NAME_MATERIAL_0000.hdf …
/// With --obj or --ply it also writes OBJ or PLY files.
template <class Simulation>
class StatesOfAll {
public:
    StatesOfAll(const Simulation& simulation, const Options& options) : options_(options) {
        for_materials<Simulation>([&](auto i) {
            const std::string material = std::remove_cvref_t<decltype(simulation.template set<i>().material())>::name;
            endings_.push_back(Simulation::material_count == 1 ? "" : "_" + material);
            series_.push_back(std::make_unique<Series>(options.output, options.name + endings_.back()));
            files_.push_back(options.file(endings_.back() + ".hdf.series"));
        });
    }
    /// Restores the simulation from the last states and continues their series.
    /// \throws firn::io_error  if there are none, or if they are of another run
    Begun go_on(Simulation& simulation) {
        std::vector<std::vector<firn::SeriesEntry>> states;
        std::size_t count = std::numeric_limits<std::size_t>::max();  // number of states that all materials have
        for (const auto& series : files_) {
            states.push_back(states_to_go_on_from(series));
            count = std::min(count, states.back().size());
        }
        for_materials<Simulation>([&](auto i) {
            const firn::SeriesEntry& last = states[i][count - 1];
            const auto file = files_[i].parent_path() / last.file;
            restore_as(options_, [&](firn::Restart how) {
                firn::restore(simulation.template set<i>(), firn::read_state<typename Simulation::scalar_type>(file),
                              how);
            });
            series_[i]->go_on_from(last.time);
        });
        count_ = int(count);
        return {std::int64_t(simulation.steps()), count_};
    }
    void write(Simulation& simulation) {
        for_materials<Simulation>([&](auto i) {
            auto state = series_[i]->spare();
            firn::state_of(simulation.template set<i>(), state);
            if (options_.obj) firn::write_obj(options_.file(endings_[i] + numbered(count_, ".obj")), state);
            if (options_.ply)
                firn::write_ply(options_.file(endings_[i] + numbered(count_, ".ply")), state, {"velocity", "mass"});
            series_[i]->write(std::move(state));
        });
        ++count_;
    }
    void finish() {
        for (auto& series : series_) series->finish();
    }
    /// The lists of states, which ParaView opens.
    [[nodiscard]] const std::vector<std::filesystem::path>& files() const { return files_; }

private:
    using Series = firn::BackgroundSeries<typename Simulation::scalar_type>;
    const Options& options_;
    std::vector<std::string> endings_;  ///< "_MATERIAL" in the files' names; "" if there is one material
    std::vector<std::unique_ptr<Series>> series_;
    std::vector<std::filesystem::path> files_;
    int count_ = 0;
};

template <class Simulation>
std::size_t particle_count(const Simulation& simulation) {
    std::size_t count = 0;
    for_materials<Simulation>([&](auto i) { count += simulation.template set<i>().particles().size(); });
    return count;
}

/// Returns the part of the space that all pictures of a run show: the particles at its start and the floor under them,
/// with some room around.
template <class Simulation>
Box frame_of(const Simulation& simulation) {
    constexpr int D = Simulation::dimension;
    const auto& domain = simulation.domain();
    Box box;
    for_materials<Simulation>([&](auto i) {
        const auto& particles = simulation.template set<i>().particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) {
                const auto x = drawn(particles.position(slot));
                box.include({{x[0], x[1], x[2]}});
            }
    });
    const bool all = box.empty();
    const float room = all ? 0 : 0.04F * box.diagonal();
    for (int a = 0; a < 3; ++a) {
        const float lower = a < D ? float(domain.lower[a]) : 0, upper = a < D ? float(domain.upper[a]) : 0;
        box.lower[a] = all || a == 1 ? lower : std::max(lower, box.lower[a] - room);
        box.upper[a] = all ? upper : std::min(upper, box.upper[a] + (a == 1 ? 0 : room));
    }
    return box;
}

/// Runs a simulation with run_schedule(). All its pictures show the same part of the space: the view's frame or, by
/// default, frame_of() the simulation at its start.
/// \param after_step  called after every step
/// \param scenery     called for every picture; returns what it shows besides the particles
template <class Simulation, class AfterStep, class MakeScenery>
Outcome run(Simulation& simulation, const Options& options, double spacing, View view, const AfterStep& after_step,
            const MakeScenery& scenery) {
    if (!view.frame) view.frame = frame_of(simulation);
    StatesOfAll states(simulation, options);
    const Begun begun = options.go_on ? states.go_on(simulation) : Begun{};
    Options timed = options;
    if (options.time)
        timed.schedule = options.schedule_of_time(simulation.time(), begun.steps, simulation.fixed_time_step);
    return run_schedule(
        timed, [&] { return std::int64_t(particle_count(simulation)); }, begun, [&] { states.write(simulation); },
        [&] { states.finish(); },
        [&] {
            simulation.step();
            after_step();
        },
        [&] { return picture(simulation, spacing, view, scenery()); }, states.files());
}

template <class Simulation, class AfterStep>
Outcome run(Simulation& simulation, const Options& options, double spacing, const View& view,
            const AfterStep& after_step) {
    return run(simulation, options, spacing, view, after_step, [] { return Scenery<Simulation::dimension>{}; });
}

}  // namespace example
