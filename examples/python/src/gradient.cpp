/// \file Compiles the derivatives of runs in one dimension.
#include "gradient.hpp"

#include <firn/adjoint.hpp>
#include <firn/any/boundary.hpp>
#include <firn/any/json.hpp>
#include <firn/any/properties.hpp>

#include <algorithm>
#include <functional>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

namespace python {

namespace {

/// The boundary of a choice, without the grids of distances that its text cannot name: they take long to compile.
template <int D>
using Boundary = firn::Together<firn::Walls<double, D>, firn::BoundaryList<firn::Collider<firn::HalfSpace<double, D>>>,
                                firn::BoundaryList<firn::Collider<firn::Sphere<double, D>>>,
                                firn::BoundaryList<firn::Collider<firn::Box<double, D>>>,
                                firn::BoundaryList<firn::Collider<firn::Capsule<double, D>>>>;

template <int D>
Boundary<D> boundary_of(const firn::SimulationChoice<D>& choice) {
    Boundary<D> boundary;
    if (!choice.boundary) {
        std::get<0>(boundary.parts) = firn::detail::default_boundary<firn::Walls<double, D>, double>(choice.domain);
        return boundary;
    }
    const auto all = firn::detail::boundary_of<double>(firn::OfferedShapes<>{}, *choice.boundary, choice.domain);
    [&]<std::size_t... K>(std::index_sequence<K...>) {
        ((std::get<K>(boundary.parts) = std::get<K>(all.parts)), ...);
    }(std::make_index_sequence<std::tuple_size_v<decltype(boundary.parts)>>{});
    return boundary;
}

/// \tparam Made  the type of the simulation: one material, in double
template <class Made>
class RunAndBackOf final : public RunAndBack {
    static constexpr int D = Made::dimension;

public:
    RunAndBackOf(Made made, const firn::SimulationChoice<D>& choice, std::size_t memory)
        : choice_(choice), simulation_(std::move(made)) {
        simulation_.warn = {};  // the run that is measured has warned
        const auto& particles = simulation_.particles();
        for (const std::uint32_t slot : firn::slots_by_id(particles, choice.threads))
            ids_.push_back(particles.id(slot));
        adjoint_.emplace(simulation_, firn::AdjointOptions{.memory = memory});
    }

    ByStart back(double duration, std::span<const double> by_position, std::span<const double> by_velocity) override {
        adjoint_->advance(duration);
        adjoint_->measure_own(by_id(by_position), by_id(by_velocity));
        const auto gradient = adjoint_->gradient();
        const auto& set = gradient.set();
        ByStart by;
        add(by, "position", set.position), add(by, "velocity", set.velocity);
        add(by, "affine_velocity", set.affine), add(by, "mass", set.mass), add(by, "volume", set.volume);
        std::apply(
            [&](const auto&... field) {
                (add(by, field.name, set.state, [&](auto& of) { return field.of(of); }), ...);
            },
            std::remove_cvref_t<decltype(set.state[0])>::fields());
        firn::for_parameters(set.material, [&](const std::string& name, const char* unit, const auto& value) {
            by.material.push_back({"material", name, unit, firn::detail::as_doubles(value)});
        });
        const auto& interval = gradient.intervals.at(0);  // there was one call of advance()
        by.gravity.assign(interval.gravity.v, interval.gravity.v + D);
        if (!choice_.boundary) return by;
        for (const firn::detail::PlaceOfPart& place : firn::detail::places_of(*choice_.boundary, {}))
            firn::detail::with_part(interval.boundary, place, [&](const auto& part) {
                firn::Json json;
                firn::detail::write(json, firn::BoundaryPart<D>(part));
                by.boundary.push_back(json.text());
            });
        return by;
    }

private:
    using Vector = firn::Vec<double, D>;

    /// Returns vectors of particles at their ids.
    std::vector<Vector> by_id(std::span<const double> numbers) const {
        if (numbers.empty()) return {};
        std::vector<Vector> all(simulation_.particles().next_id());
        for (std::size_t i = 0; i < ids_.size(); ++i) std::copy_n(&numbers[i * D], D, all[ids_[i]].v);
        return all;
    }
    static void append(std::vector<double>& to, double number) { to.push_back(number); }
    static void append(std::vector<double>& to, const firn::VolumeRatio<double>& ratio) { to.push_back(double(ratio)); }
    template <int N>
    static void append(std::vector<double>& to, const firn::Vec<double, N>& vector) {
        to.insert(to.end(), vector.v, vector.v + N);
    }
    template <int N>
    static void append(std::vector<double>& to, const firn::Mat<double, N>& matrix) {
        for (int row = 0; row < N; ++row)
            for (int column = 0; column < N; ++column) to.push_back(matrix(row, column));
    }
    /// Adds the derivatives by a field. \param all  those of all ids;  \param of  returns the field's own
    template <class All, class Of = std::identity>
    void add(ByStart& by, const char* name, const All& all, const Of& of = {}) const {
        ByField field{name, firn::component_count<std::remove_cvref_t<decltype(of(all[0]))>>, {}};
        for (const std::uint32_t id : ids_) append(field.numbers, of(all[id]));
        by.fields.push_back(std::move(field));
    }

    firn::SimulationChoice<D> choice_;
    Made simulation_;
    std::vector<std::uint32_t> ids_;  // of the particles, which stay
    std::optional<firn::Adjoint<Made>> adjoint_;
};

/// Makes the run if the set has the material M; otherwise nothing.
template <int D, class Transfer, template <class> class M>
std::unique_ptr<RunAndBack> made(const firn::SetOf<double, D>& of, const firn::SimulationChoice<D>& choice,
                                 const firn::Moment& moment, std::size_t memory) {
    using Set = firn::MaterialSet<D, M<double>>;
    using Made = firn::SimulationWith<D, M<double>, Transfer, Boundary<D>>;
    const auto* const set = dynamic_cast<const Set*>(&of);
    if (!set) return nullptr;
    Made simulation(choice.domain, set->material, firn::Coloured{choice.threads}, boundary_of(choice));
    firn::detail::set_parameters(simulation.transfer, choice.transfer_parameters, choice.transfer);
    simulation.gravity = *choice.gravity;
    simulation.fixed_time_step = choice.fixed_time_step;
    simulation.most_steps_between_sorts = choice.most_steps_between_sorts;
    simulation.restore(Set(*set), moment);
    return std::make_unique<RunAndBackOf<Made>>(std::move(simulation), choice, memory);
}

}  // namespace

template <int D>
std::unique_ptr<RunAndBack> run_and_back(const firn::AnySimulation<D>& simulation, std::size_t memory) {
    const firn::SimulationChoice<D> choice = simulation.choice();
    if (choice.precision != "double")
        throw firn::parameter_error(firn::sentence("Derivatives need the precision \"double\"; this simulation has \"",
                                                   choice.precision, "\"."));
    if (choice.materials.size() != 1)
        throw firn::parameter_error(
            firn::sentence("There are derivatives through runs of one material; this simulation has ",
                           choice.materials.size(), ". firn::Adjoint in C++ takes several."));
    const std::string& material = choice.materials[0].name;
    const firn::SetOf<double, D>& set = *std::get<const firn::SetOf<double, D>*>(simulation.stored_set(0));
    const firn::Moment moment{simulation.time(), simulation.steps(), simulation.last_time_step()};
    if (!set.sources.empty() || !set.sinks.empty())
        throw firn::parameter_error(
            "There are derivatives through runs without sources and sinks; firn::Adjoint in C++ takes them.");
    std::unique_ptr<RunAndBack> back;
    const auto look = [&]<class Transfer, template <class> class... M>(Transfer, firn::OfferedMaterials<M...>) {
        if (choice.transfer != firn::name_of<Transfer>()) return;
        ((back ? void() : void(back = made<D, Transfer, M>(set, choice, moment, memory))), ...);
        if (!back)
            throw firn::parameter_error(firn::sentence(
                "There are no derivatives through '", material,
                "' here; there are through: ", firn::detail::listed_names({std::string(firn::name_of<M<double>>())...}),
                ". firn::Adjoint in C++ takes others, too."));
    };
    look(firn::Apic{}, WithDerivatives{});
    look(firn::Aflip<>{}, WithDerivatives{});
    return back;
}

template std::unique_ptr<RunAndBack> run_and_back(const firn::AnySimulation<FIRN_PYTHON_DIMENSION>&, std::size_t);

}  // namespace python
