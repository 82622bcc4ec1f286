/// \file The material SofteningBand: a model that softens, so that the work of a shear band does not depend on the
/// cells.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/material/surroundings.hpp>

#include <cmath>
#include <concepts>
#include <tuple>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_softening_band {
    static constexpr const char* name = "softening_band";
};
}  // namespace detail

/// A model that softens with plastic strain, whose softening strain is scaled by the cell size.
///
/// Flow that softens gathers in bands, which a grid resolves as about a cell wide. A band of soil has a width of its
/// own, some ten grains, and most grids are coarser. With the model alone, a band slides until its strength is the
/// residual one by `softening_strain` times the cell size, so what it does is less work the finer the cells are. With
/// SofteningBand the softening strain of the model is that of a band as wide as `band_width`, and on the grid it is
///
///     softening_strain · band_width / cell_size
///
/// so the band slides as far, and does as much work per area, on every grid. If that strain is not larger than the
/// elastic strain at yield, the cells are too large for that: the strength then falls at once, and the elastic energy
/// of a cell does more than the work of the band.
///
///     const SofteningBand<MohrCoulomb<float>> clay{MohrCoulomb<float>::from_properties({.softening_strain = 2}),
///     0.01};
///
/// The cell size comes from the simulation. An Adjoint, and stages that a program calls by themselves, know no
/// surroundings: give them the model itself with softening_strain_in(cell_size).
///
/// Bažant and Oh 1983, "Crack band theory for fracture of concrete"; Pietruszczak and Mróz 1981, "Finite element
/// analysis of deformation of strain-softening materials".
/// \tparam Model  a material with a parameter `softening_strain` [1]: MohrCoulomb
template <class Model>
    requires requires(Model model) {
        { model.softening_strain } -> std::same_as<material_scalar_t<Model>&>;
    }
struct SofteningBand : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The scalar type of the model.
    /// The type of this material with scalar type T.
    template <class T>
    using with_scalar = SofteningBand<with_scalar_t<Model, T>>;

    S band_width = S(0.01);  ///< width of a shear band that has the model's softening strain [m]

    static constexpr const char* name = detail::joined_names<detail::named_softening_band, Model>::text;
    static constexpr auto parameters() {
        return std::tuple_cat(Model::parameters(),
                              std::tuple{parameter{"band_width", "m", &SofteningBand::band_width}});
    }

    /// Checks the parameters.
    /// \throws parameter_error if the model's check() does, or unless band_width > 0 and finite
    void check() const
        requires std::floating_point<S>
    {
        if constexpr (requires { Model::check(); }) Model::check();
        if (!(band_width > 0) || !std::isfinite(band_width))
            throw parameter_error(sentence("The width of a shear band is ", band_width,
                                           " m; it must be positive and finite. If it need not be the same on every "
                                           "grid, take the model itself."));
    }

    /// Returns the softening strain on a grid of the given cell size [m]: softening_strain · band_width / cell_size
    /// [1].
    FIRN_INLINE S softening_strain_in(const S& cell_size) const {
        return this->softening_strain * band_width / cell_size;
    }
    /// The material for one particle. Its softening strain is that of the grid, so its band is as wide as a cell.
    template <int D>
    FIRN_INLINE SofteningBand at(const Surroundings<S, D>& here) const {
        SofteningBand scaled = *this;
        if constexpr (asks_surroundings<Model, D>) scaled = detail::around_model(*this, Model(Model::at(here)));
        scaled.softening_strain = scaled.softening_strain_in(here.cell_size);
        scaled.band_width = here.cell_size;
        return scaled;
    }
    /// The model's state after its return mapping, and the Kirchhoff stress [Pa] in this state.
    template <int D>
        requires has_returned_with_stress<Model, D>
    FIRN_INLINE StateAndStress<material_state_t<Model, D>, S, D> returned_with_stress(
        const material_state_t<Model, D>& trial) const {
        return Model::template returned_with_stress<D>(trial);
    }
};

}  // namespace firn::inline FIRN_BUILD
