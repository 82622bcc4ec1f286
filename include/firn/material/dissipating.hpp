/// \file Any model, and how much energy its plastic flow takes.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/concept.hpp>

namespace firn {

namespace detail {
struct named_dissipating {
    static constexpr const char* name = "dissipating";
};
}  // namespace detail

/// Keeps a number more a particle: the elastic energy that the return mapping took out, Σ ψ(trial) − ψ(returned)
/// [J/m³ of undeformed volume]. Where a model hardens while it yields, what hardening puts into ψ counts against it.
/// \tparam Model  offers energy_density
template <class Model>
struct Dissipating : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;
    template <class T>
    using with_scalar = Dissipating<with_scalar_t<Model, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_dissipating, Model>::text;

    template <int D>
    struct state : material_state_t<Model, D> {
        static_assert(!has_updated<Model, D>, "firn: Dissipating takes models with a return mapping");

        S dissipated = S(0);  ///< [J/m³]

        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{"dissipated_energy", "J/m^3", &state::dissipated}});
        }
    };

    template <int D>
    state<D> initial_state() const {
        return {firn::initial_state<D>(static_cast<const Model&>(*this)), S(0)};
    }
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return loss(trial, returned_by(static_cast<const Model&>(*this), base(trial)));
    }
    template <int D>
        requires has_returned_with_stress<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const auto mapped = Model::returned_with_stress(base(trial));
        return {loss(trial, mapped.state), mapped.stress};
    }

private:
    template <int D>
    using Base = material_state_t<Model, D>;
    template <int D>
    FIRN_INLINE static const Base<D>& base(const state<D>& particle) {
        return particle;
    }
    /// The state after the return mapping, and what it took.
    template <int D>
    FIRN_INLINE state<D> loss(const state<D>& trial, const Base<D>& after) const {
        const Model& model = *this;
        return {after,
                trial.dissipated + (firn::energy_density(model, base(trial)) - firn::energy_density(model, after))};
    }
};

}  // namespace firn
