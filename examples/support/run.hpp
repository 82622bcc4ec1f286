/// \file What every example does with a simulation: steps, a progress bar, HDF5 states, OBJ files, a picture.
#pragma once

#include "support/run_schedule.hpp"
#include "support/solids.hpp"
#include <firn/firn.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/states.hpp>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>

namespace example {

/// Positions of a material's particles in the order of ids.
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

/// f(number of the material) for each material of the simulation; the number is a compile-time constant.
template <class Simulation, class F>
void for_materials(const F& f) {
    firn::unroll<int(Simulation::material_count)>(
        [&](auto i) { f(std::integral_constant<std::size_t, std::size_t(i)>{}); });
}

/// How a picture is coloured, and what it shows besides particles: the surfaces of solids, as points.
template <int D>
struct Scenery {
    std::vector<firn::Vec<double, D>> points{};
    Colour solid = slate;
    std::vector<Colour>
        colours{};  ///< of the materials; of one material, of its bodies; or none: in the palette's order
};

/// The nets of a simulation's I-th material as surfaces of one colour.
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

/// A cloud of all particles, nets as surfaces: a colour for each material, or, of one material, for each body.
template <class Simulation>
Cloud cloud_of(const Simulation& simulation, double spacing, const Scenery<Simulation::dimension>& scenery = {}) {
    constexpr int D = Simulation::dimension;
    Cloud cloud;
    cloud.radius = float((D == 3 ? 0.6 : 0.75) * spacing);
    const auto add = [&](const firn::Vec<double, D>& x, std::uint8_t colour) {
        cloud.positions.push_back({float(x[0]), float(x[1]), D == 3 ? float(x[D - 1]) : 0.0F});
        cloud.colour.push_back(colour);
    };
    for_materials<Simulation>([&](auto i) {
        const auto& particles = simulation.template set<i>().particles();
        const auto& bodies = simulation.template set<i>().bodies();
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
            add(firn::cast<double>(particles.position(slot)), colour_of(number));
        }
    });
    for (const auto& x : scenery.points) add(x, scenery.solid);
    return cloud;
}

/// A picture of the particles.
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

/// Writes the states of a run: OUTPUT/NAME_0000.hdf …, or for each of several materials OUTPUT/NAME_MATERIAL_0000.hdf;
/// and .obj, if that is wanted.
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
    /// Puts the simulation where its last states are, and goes on with their series.
    /// \throws firn::io_error  where there are none, or they are of another run
    Begun go_on(Simulation& simulation) {
        std::vector<std::vector<firn::SeriesEntry>> states;
        std::size_t count = std::numeric_limits<std::size_t>::max();  // that all materials have
        for (const auto& series : files_) {
            states.push_back(states_to_go_on_from(series));
            count = std::min(count, states.back().size());
        }
        for_materials<Simulation>([&](auto i) {
            const firn::SeriesEntry& last = states[i][count - 1];
            const auto file = files_[i].parent_path() / last.file;
            firn::restore(simulation.template set<i>(), firn::read_state<typename Simulation::scalar_type>(file));
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
            series_[i]->write(std::move(state));
        });
        ++count_;
    }
    void finish() {
        for (auto& series : series_) series->finish();
    }
    /// What ParaView opens.
    [[nodiscard]] const std::vector<std::filesystem::path>& files() const { return files_; }

private:
    using Series = firn::BackgroundSeries<typename Simulation::scalar_type>;
    const Options& options_;
    std::vector<std::string> endings_;  ///< of the files' names: the materials
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

/// Runs the schedule: see run_schedule().
/// \param after_step  called after every step
/// \param scenery     scenery() at the end says what the picture shows besides
template <class Simulation, class AfterStep, class SceneryAtEnd>
void run(Simulation& simulation, const Options& options, double spacing, const View& view, const AfterStep& after_step,
         const SceneryAtEnd& scenery) {
    StatesOfAll states(simulation, options);
    const Begun begun = options.go_on ? states.go_on(simulation) : Begun{};
    run_schedule(
        options, std::int64_t(particle_count(simulation)), begun, [&] { states.write(simulation); },
        [&] { states.finish(); },
        [&] {
            simulation.step();
            after_step();
        },
        [&] { return picture(simulation, spacing, view, scenery()); }, states.files());
}

template <class Simulation, class AfterStep>
void run(Simulation& simulation, const Options& options, double spacing, const View& view,
         const AfterStep& after_step) {
    run(simulation, options, spacing, view, after_step, [] { return Scenery<Simulation::dimension>{}; });
}

}  // namespace example
