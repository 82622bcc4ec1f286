/// \file The materials of a simulation, each with particles of its own.
#pragma once

#include <firn/data/particles.hpp>
#include <firn/exec/g2p.hpp>
#include <firn/material/concept.hpp>
#include <firn/simulation/source.hpp>

#include <functional>
#include <tuple>
#include <vector>

namespace firn {

/// Several constitutive models in one simulation, all of one precision: Simulation<3, Materials<Snow<float>,
/// Sand<float>>>. Each has particles of its own, with its own state; all meet on one grid.
template <class... M>
struct Materials {
    std::tuple<M...> models;

    Materials() = default;
    Materials(const M&... each) : models(each...) {}
};

namespace detail {
template <class Material>
struct material_list {
    using type = Materials<Material>;
};
template <class... M>
struct material_list<Materials<M...>> {
    using type = Materials<M...>;
};
template <class List>
struct first_material;
template <class First, class... Rest>
struct first_material<Materials<First, Rest...>> {
    using type = First;
    static_assert((std::same_as<material_scalar_t<First>, material_scalar_t<Rest>> && ...),
                  "firn: the materials of one simulation are of one precision.");
};
/// The precision of a material, or of a list of them.
template <class Material>
using precision_of_t = material_scalar_t<typename first_material<typename material_list<Material>::type>::type>;
}  // namespace detail

/// The ids [first, first + count) that one call of Simulation::add gave out among the particles of its material.
struct Body {
    std::uint32_t first = 0, count = 0;
    double end = std::numeric_limits<double>::infinity();  ///< when its particles are taken out [s]
};

/// A force on every particle of a body: a traction [Pa] on a face comes to traction × area / particles of the face.
template <int D>
struct Load {
    Body body;
    std::function<Vec<double, D>(const Vec<double, D>& position, double time)> force;  ///< of [m] and [s], in N
};

/// A material's particles and what is known of them.
template <int D, class Material>
struct MaterialSet {
    static_assert(require_material<Material, D>());
    using S = material_scalar_t<Material>;

    Material material;
    Particles<S, D, material_state_t<Material, D>> particles;
    BlockPartition<D> partition{};
    std::vector<Body> bodies{};
    G2PReport report{};      ///< of the last G2P
    bool prepared = false;   ///< sorted, with stress and report up to date
    bool checked = false;    ///< all positions are known to lie in the domain
    bool as_sorted = false;  ///< no step since particles were sorted
    std::vector<Source<D>> sources{};
    std::vector<Sink<D>> sinks{};
    std::vector<Load<D>> loads{};
};

namespace detail {
/// A tuple of the sets of a list of materials.
template <int D, class List>
struct material_sets;
template <int D, class... M>
struct material_sets<D, Materials<M...>> {
    using type = std::tuple<MaterialSet<D, M>...>;

    static type make(const Materials<M...>& materials, const Domain<D>& domain) {
        return std::apply(
            [&](const M&... model) {
                return type{MaterialSet<D, M>{model, decltype(MaterialSet<D, M>::particles)(domain)}...};
            },
            materials.models);
    }
    /// Of a material in the list.
    template <class Wanted>
    static constexpr std::size_t place() {
        static_assert(
            (std::size_t(std::same_as<Wanted, M>) + ...) == 1,
            "firn: name one of the simulation's materials; one that is there twice, by its place in the list.");
        std::size_t i = 0, found = 0;
        ((std::same_as<Wanted, M> ? void(found = i) : void(), ++i), ...);
        return found;
    }
};
}  // namespace detail

}  // namespace firn
