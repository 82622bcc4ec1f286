/// \file The simulation behind an AnySimulation, with its types. One file of a program includes this, or several that
/// share the work. \see FIRN_COMPILE_OFFER
#pragma once

#include <firn/any/offer.hpp>
#include <firn/any/run.hpp>
#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/simulation.hpp>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// The functions of a simulation of these types.
template <class Simulation>
class AnyRunOf final : public AnyRun<Simulation::dimension> {
    static constexpr int D = Simulation::dimension;
    using S = typename Simulation::scalar_type;

public:
    /// \param sets  of each material of the choice, its index among the materials of the simulation
    AnyRunOf(Simulation simulation, std::vector<std::size_t> sets)
        : simulation_(std::move(simulation)), sets_(std::move(sets)) {}

    std::unique_ptr<AnyRun<D>> copy() const override { return std::make_unique<AnyRunOf>(*this); }
    Stepper<D>& stepper() override { return simulation_; }
    std::variant<RunOf<float, D>*, RunOf<double, D>*> run() override { return static_cast<RunOf<S, D>*>(&simulation_); }
    std::size_t index_of(std::size_t k) const override { return sets_[k]; }
    void step() override { simulation_.step(); }
    void advance(double duration) override { simulation_.advance(duration); }
    double stable_time_step() override { return simulation_.stable_time_step(); }
    Body add(std::size_t k, const Samples<D>& samples, double density, const Vec<double, D>& velocity) override {
        Body body{};
        with_set(k, [&](auto set) { body = set.add(samples, density, velocity); });
        return body;
    }
    void add_source(std::size_t k, const Source<D>& source) override {
        with_set(k, [&](auto set) { set.add_source(source); });
    }
    void add_sink(std::size_t k, const Sink<D>& sink) override {
        with_set(k, [&](auto set) { set.add_sink(sink); });
    }
    std::size_t remove_if(std::size_t k,
                          const std::function<bool(const Vec<double, D>&, std::uint32_t)>& wanted) override {
        std::size_t removed = 0;
        with_set(k, [&](auto set) { removed = set.remove_if(wanted); });
        return removed;
    }
    const std::vector<Body>& bodies(std::size_t k) const override { return simulation_.sets()[sets_[k]].bodies; }
    Totals<D> totals(std::size_t k) const override {
        Totals<D> totals;
        with_set(k, [&](auto set) { totals = set.totals(); });
        return totals;
    }
    AnyStore<D> edit_particles(std::size_t k) override {
        ParticleStore<S, D>* store = nullptr;
        with_set(k, [&](auto set) { store = &set.edit_particles(); });
        return store;
    }
    void edit_material(std::size_t k, const std::vector<NamedNumber>& parameters) override {
        with_set(k, [&](auto set) {
            set.edit_material([&]<class M>(M& model) { set_parameters(model, parameters, name_of<M>()); });
        });
    }
    std::vector<StateParameter> material(std::size_t k) const override {
        std::vector<StateParameter> all;
        with_set(k, [&](auto set) {
            for_parameters(set.material(), [&](const std::string& name, const char* unit, const auto& value) {
                all.push_back({"material", name, unit, as_doubles(value)});
            });
        });
        return all;
    }
    BoundaryPart<D> part(BoundaryPart<D> given, const PlaceOfPart& place) const override {
        with_part(simulation_.boundary, place, [&](const auto& own) {
            if constexpr (requires { own.rotation; })
                std::visit(
                    [&](auto& one) {
                        if constexpr (requires { one.rotation; }) {
                            one.position = own.position;
                            one.rotation = own.rotation;
                        }
                    },
                    given);
        });
        return given;
    }
    void set_part(const BoundaryPart<D>& part, const PlaceOfPart& place) override {
        with_part(simulation_.boundary, place, [&]<class Own>(Own& own) {
            const auto one = exact_part<Own>(part);
            check_boundary(one);
            own = lift<S>(one);
        });
    }
    Reaction<D> reaction(const PlaceOfPart& place) const override {
        if (!simulation_.reactions)
            throw usage_error("Reactions are not measured; call measure_reactions() before the step.");
        const auto part = std::size_t(index_of_part(simulation_.boundary, place));
        if (part >= simulation_.reactions->parts.size())
            throw usage_error("No step has measured reactions yet; take one.");
        return simulation_.reactions->parts[part];
    }
    AnyState state(std::size_t k) override {
        State<S> state;
        with_set(k, [&](auto set) { state_of(set, state); });
        return state;
    }
    void restore(std::size_t k, const AnyState& state, Restart how) override {
        with_set(k, [&](auto set) { std::visit([&](const auto& given) { firn::restore(set, given, how); }, state); });
    }

private:
    template <class F>
    void with_set(std::size_t k, const F& f) {
        with_set_of(simulation_, sets_[k], f);
    }
    template <class F>
    void with_set(std::size_t k, const F& f) const {
        with_set_of(simulation_, sets_[k], f);
    }
    /// Calls f(set) for the set of this index. \tparam Of  Simulation, or const Simulation
    template <class Of, class F>
    static void with_set_of(Of& simulation, std::size_t index, const F& f) {
        [&]<std::size_t... I>(std::index_sequence<I...>) {
            ((I == index ? void(f(simulation.template set<I>())) : void()), ...);
        }(std::make_index_sequence<Simulation::material_count>{});
    }

    Simulation simulation_;
    std::vector<std::size_t> sets_;
};

/// Calls f(std::type_identity<One>) for the type of the list whose name is `wanted`.
/// \throws parameter_error  if there is none
template <template <class...> class List, class... One, class F>
void with_offered(List<One...>, const char* kind, const std::string& wanted, const F& f) {
    bool found = false;
    const auto look = [&]<class P>(std::type_identity<P> type) {
        if (found || name_of<P>() != wanted) return;
        found = true;
        f(type);
    };
    (look(std::type_identity<One>{}), ...);
    if (!found) throw_not_offered(kind, wanted, {std::string(name_of<One>())...});
}

/// Makes the simulation of a choice that has these policies.
template <int D, class S, class Transfer, class Kernel, class Force, template <class> class... M,
          template <class, int> class... Own>
std::unique_ptr<AnyRun<D>> made(OfferedMaterials<M...>, OfferedShapes<Own...> shapes,
                                const SimulationChoice<D>& choice) {
    using Boundary = AnyBoundary<S, D, Own...>;
    using Made = Simulation<D, Materials<M<S>...>, Transfer, Force, Kernel, Coloured, Boundary>;
    check(choice.domain);
    Materials<M<S>...> materials;
    std::vector<std::size_t> sets;
    for (const MaterialChoice& material : choice.materials) {
        std::size_t index = 0;
        bool found = false;
        const auto look = [&]<class Model>(Model& model) {
            if (!found && name_of<Model>() == material.name) {
                found = true;
                if (std::find(sets.begin(), sets.end(), index) != sets.end())
                    throw parameter_error(
                        sentence("The material '", material.name,
                                 "' is there twice; a simulation has one set of each. Put both bodies "
                                 "into it, and offer PerParticle for numbers of their own."));
                sets.push_back(index);
                model = material_of<Model>(material.properties, material.parameters);
                check_material<D>(model);
            }
            ++index;
        };
        std::apply([&](auto&... model) { (look(model), ...); }, materials.models);
        if (!found) throw_not_offered("material", material.name, {std::string(name_of<M<S>>())...});
    }
    if (sets.empty()) throw parameter_error("The choice has no material; give at least one.");
    Boundary boundary =
        boundary_of<S, D>(shapes, choice.boundary.value_or(std::vector<BoundaryPart<D>>{}), choice.domain);
    if (!choice.boundary) std::get<0>(boundary.parts) = default_boundary<Walls<S, D>, S>(choice.domain);
    Made simulation(choice.domain, materials, Coloured{choice.threads}, boundary);
    set_parameters(simulation.transfer, choice.transfer_parameters, name_of<Transfer>());
    if constexpr (requires { simulation.transfer.check(); }) simulation.transfer.check();
    if (choice.gravity) simulation.gravity = *choice.gravity;
    simulation.fixed_time_step = choice.fixed_time_step;
    simulation.most_steps_between_sorts = choice.most_steps_between_sorts;
    return std::make_unique<AnyRunOf<Made>>(std::move(simulation), std::move(sets));
}

/// Makes the simulation of a choice, if it is of precision S.
/// \throws parameter_error  if the offer lacks a name of the choice, or if a number is out of range
template <int D, class S, class Offer>
std::unique_ptr<AnyRun<D>> make_run(const SimulationChoice<D>& choice) {
    std::unique_ptr<AnyRun<D>> run;
    with_offered(typename Offer::kernels{}, "kernel", choice.kernel, [&]<class Kernel>(std::type_identity<Kernel>) {
        with_offered(typename Offer::forces{}, "force form", choice.force, [&]<class Force>(std::type_identity<Force>) {
            with_offered(typename Offer::transfers{}, "transfer", choice.transfer,
                         [&]<class Transfer>(std::type_identity<Transfer>) {
                             run = made<D, S, Transfer, Kernel, Force>(typename Offer::materials{},
                                                                       typename Offer::shapes{}, choice);
                         });
        });
    });
    return run;
}

}  // namespace firn::inline FIRN_BUILD::detail

/// Compiles what an offer has in one precision and dimension: `FIRN_COMPILE_OFFER(3, float, MyOffer)`, outside of all
/// namespaces. Of a large offer, each precision and dimension may be compiled in a file of its own, at the same time.
/// The other files of the program then include firn/any_simulation.hpp only.
#define FIRN_COMPILE_OFFER(D, S, ...)                                                            \
    template std::unique_ptr<firn::detail::AnyRun<D>> firn::detail::make_run<D, S, __VA_ARGS__>( \
        const firn::SimulationChoice<D>&)
