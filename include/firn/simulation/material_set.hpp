/// \file The list of materials of a simulation, and the set of particles of each material.
#pragma once

#include <firn/data/particles.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/material/concept.hpp>
#include <firn/material/no_stress.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/simulation/stretch.hpp>

#include <algorithm>
#include <span>
#include <tuple>

namespace firn::inline FIRN_BUILD {

/// A list of constitutive models of the same precision for one simulation: `Simulation<3, Materials<Snow<float>,
/// Sand<float>>>`. Each model has its own set of particles, which carry the state of that model. All sets share one
/// grid.
template <class... M>
struct Materials {
    std::tuple<M...> models;  ///< The constitutive models, in the order of the list.

    Materials() = default;
    Materials(const M&... each) : models(each...) {}  ///< Makes a list of these models.
};

namespace detail {
template <class Material>
struct listed {
    using type = Materials<Material>;
};
template <class... M>
struct listed<Materials<M...>> {
    using type = Materials<M...>;
};

template <class List>
struct precision_of;
template <class First, class... Rest>
struct precision_of<Materials<First, Rest...>> {
    using type = typename std::conditional_t<require_material_scalar<First>(), material_scalar<First>,
                                             std::type_identity<float>>::type;
};
/// The scalar type (float or double) of a material, or of the materials of a list.
template <class Material>
using precision_of_t = typename precision_of<typename listed<Material>::type>::type;

/// Returns true. If a simulation cannot have these materials, the compiler stops with a message.
template <int D, class First, class... Rest>
consteval bool require_materials(std::type_identity<Materials<First, Rest...>>) {
    if constexpr ((require_material<First, D>() && ... && require_material<Rest, D>())) {
        using S = material_scalar_t<First>;
        constexpr bool rounds = std::same_as<S, float> || std::same_as<S, double>;
        static_assert(rounds,
                      "firn: a simulation computes with float or double. Dual numbers, packs and the scalar that "
                      "writes WGSL run a policy's functions, not whole simulations: see examples/guide/03.");
        constexpr bool same = (std::same_as<material_scalar_t<First>, material_scalar_t<Rest>> && ...);
        static_assert(
            same, "firn: the materials of one simulation are of one precision: Materials<Snow<float>, Sand<float>>.");
        return same && rounds;
    } else {
        return false;
    }
}
/// The type of the list of materials, `Materials<…>`. If the given list is not valid, this is a valid list instead, so
/// that the compiler prints only one message.
template <class Material, int D>
using material_list = std::conditional_t<require_materials<D>(std::type_identity<typename listed<Material>::type>{}),
                                         typename listed<Material>::type, Materials<NoStress<float>>>;
}  // namespace detail

namespace detail {
inline constexpr std::size_t unnamed_material = std::size_t(-1);

/// Returns the index I of the material that the program named, in the list of materials; 0 if the program named none.
/// If the list has several materials, the program must name one.
template <std::size_t I, std::size_t Count>
constexpr std::size_t named_material() {
    static_assert(I != unnamed_material || Count == 1,
                  "firn: this simulation has several materials: say which one is meant, as in "
                  "simulation.set<Snow<float>>().add(…), or give its place, simulation.set<1>().add(…).");
    return I == unnamed_material ? 0 : I;
}
}  // namespace detail

/// The set of particles of one material: what SetOf leaves to the material.
template <int D, class Material>
class MaterialSet final : public SetOf<material_scalar_t<Material>, D> {
public:
    using S = material_scalar_t<Material>;  ///< The scalar type: float or double.
    static constexpr int dimension = D;     ///< The dimension: 2 or 3.

    Material material;                                         ///< The constitutive model.
    Particles<S, D, material_state_t<Material, D>> particles;  ///< The particles of this material.

    /// Makes a set without particles.
    MaterialSet(const Material& model, const Domain<D>& domain) : material(model), particles(domain) {}

    [[gnu::cold]] std::unique_ptr<SetOf<S, D>> copy() const override { return std::make_unique<MaterialSet>(*this); }
    ParticleStore<S, D>& store() override { return particles; }
    std::string_view name_of_material() const override { return name_of<Material>(); }
    void start_state(std::size_t slot) override { particles.set_state(slot, initial_state<D>(material)); }
    detail::PassReport update_stress(int threads, double time) override {
        const auto view = particles.view();
        const Domain<D>& domain = particles.domain();
        const detail::surroundings_for<Material, decltype(particles.view())> around(view, this->partition, domain,
                                                                                    time);
        return detail::update_stress_pass(threads, view, this->partition, material, domain.cell_size, around);
    }
    [[gnu::cold]] void read_facts(double dt, detail::FactsReader& reader) override {
        const Domain<D>& domain = particles.domain();
        detail::read_facts(particles.view(), this->partition, &domain, domain.cell_size, material, dt, reader);
    }
    std::vector<detail::Stretched> most_stretched([[maybe_unused]] const KernelFacts& kernel,
                                                  [[maybe_unused]] int threads) override {
        if constexpr (detail::tells_stretch<Material, D>)
            return detail::most_stretched(kernel, particles, particles.view(), material, threads);
        return {};
    }
    std::optional<detail::GradientFacts<S, D>> gradient_of([[maybe_unused]] std::size_t slot) const override {
        if constexpr (requires { particles.state(slot).F; })
            return detail::gradient_facts<S, D>(particles.state(slot).F);
        return {};
    }
    std::span<const StateOutput> outputs() const override {
        if constexpr (has_outputs<Material, D>) {
            static_assert(Material::outputs.size() <= most_outputs, "firn: a material has at most 8 outputs.");
            return Material::outputs;
        } else {
            return {};
        }
    }
    /// Computes the outputs of a particle. \param time  the present time [s]
    /// \param to  memory for as many numbers as there are outputs
    void output([[maybe_unused]] std::size_t slot, [[maybe_unused]] double time,
                [[maybe_unused]] S* to) const override {
        if constexpr (has_outputs<Material, D>) {
            const auto here = [&] { return detail::surroundings_of_particle<S>(particles, slot, time); };
            std::ranges::copy(placed<D>(material, here).output(particles.state(slot)), to);
        }
    }
    bool is_elastic() const override { return detail::is_elastic<Material, D>; }

    /// Replaces the particles and bodies by those of `stored`. The sources, sinks, loads, forces and facets of this set
    /// are kept. \see SetOf::hand_over
    void restore(MaterialSet&& stored, const Moment& moment) {
        this->hand_over(stored, moment);
        *this = std::move(stored);
    }

    /// Calls change(position [m], state) for each particle of the body. `change` may modify `state`. The next step
    /// computes the stresses from the new states.
    /// \throws parameter_error  if `body` is not one of the bodies of this set
    template <class Change>
    void change_states(const Body& body, const Change& change) {
        this->check_body(body);
        this->readiness.edit();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            auto state = particles.state(slot);
            change(particles.exact_position(slot), state);
            particles.set_state(slot, state);
        }
    }
};

namespace detail {
/// The sets of a list of materials.
template <int D, class List>
struct material_sets;
template <int D, class... M>
struct material_sets<D, Materials<M...>> {
    static constexpr std::size_t count = sizeof...(M);  ///< Number of materials.
    template <std::size_t I>
    using set = MaterialSet<D, std::tuple_element_t<I, std::tuple<M...>>>;  ///< The type of set I.

    /// Makes one empty particle set per material.
    /// \param given  a list of materials, or a single material
    template <class Given>
    static auto make(const Given& given, const Domain<D>& domain) {
        Materials<M...> materials;
        if constexpr (std::is_constructible_v<Materials<M...>, const Given&>) materials = Materials<M...>(given);
        SetList<precision_of_t<Materials<M...>>, D> sets;
        std::apply([&](const M&... model) { (sets.add(std::make_unique<MaterialSet<D, M>>(model, domain)), ...); },
                   materials.models);
        return sets;
    }
    /// Returns the index of the material `Wanted` in the list of materials, counted from 0.
    template <class Wanted>
    static constexpr std::size_t index_of() {
        static_assert(
            (std::size_t(std::same_as<Wanted, M>) + ...) == 1,
            "firn: name one of the simulation's materials. If it is in the list twice, give its place: set<1>().");
        std::size_t i = 0, found = 0;
        ((std::same_as<Wanted, M> ? void(found = i) : void(), ++i), ...);
        return found;
    }
};
}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
