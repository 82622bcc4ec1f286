/// \file Any plastic model, with a record of the energy that its plastic flow takes.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/concept.hpp>

namespace firn {

namespace detail {
struct named_dissipating {
    static constexpr const char* name = "dissipating";
};
}  // namespace detail

/// Records the elastic energy that a model's return mapping removes, one more field per particle.
///
/// The field `dissipated_energy` [J/m³ of undeformed volume] grows in each step by
///
///     ψ(trial) − ψ(returned)
///
/// If the model hardens while it yields, the energy that hardening adds to ψ is subtracted. All else is as in the
/// model. Take it to see where plastic flow happens, or to close the balance of energy: Dissipating<Sand<float>>.
/// \tparam Model  a material with a return mapping and energy_density()
template <class Model>
struct Dissipating : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The type of the numbers it computes with.
    /// The same wrapper around the model with scalar T.
    template <class T>
    using with_scalar = Dissipating<with_scalar_t<Model, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_dissipating, Model>::text;

    /// The model's state and the dissipated energy.
    template <int D>
    struct state : material_state_t<Model, D> {
        static_assert(!has_updated<Model, D>, "firn: Dissipating takes models with a return mapping");

        S dissipated = S(0);  ///< energy taken by plastic flow so far [J/m³ of undeformed volume]

        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{"dissipated_energy", "J/m^3", &state::dissipated}});
        }
    };

    /// The model's first state, with no energy dissipated.
    template <int D>
    state<D> initial_state() const {
        return {firn::initial_state<D>(static_cast<const Model&>(*this)), S(0)};
    }
    /// The model's return mapping, with the energy that it removes added to the record.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return loss(trial, returned_by(static_cast<const Model&>(*this), base(trial)));
    }
    /// The same and the Kirchhoff stress [Pa], if the model computes both together.
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
    /// The state after the return mapping, with the lost energy added.
    template <int D>
    FIRN_INLINE state<D> loss(const state<D>& trial, const Base<D>& after) const {
        const Model& model = *this;
        return {after,
                trial.dissipated + (firn::energy_density(model, base(trial)) - firn::energy_density(model, after))};
    }
};

}  // namespace firn
