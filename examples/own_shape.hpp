/// \file A user-defined solid in one small file: it runs in 2D and 3D, in float and double. firn/boundary/shape.hpp
/// says what else a shape may have.
#pragma once

#include <firn/boundary/shapes.hpp>

/// A box with rounded edges and corners, with its centre at the origin and its faces along the axes.
template <firn::scalar S, int D>
struct RoundedBox {
    firn::Vec<S, D> half_extents = firn::Vec<S, D>::filled(S(0.1));  ///< from the centre to the faces [m]
    S rounding = S(0.02);                                            ///< radius of the edges [m]

    static constexpr const char* name = "rounded_box";
    static constexpr bool convex = true;
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"half_extents", "m", &RoundedBox::half_extents},
                          firn::parameter{"rounding", "m", &RoundedBox::rounding}};
    }
    void check() const
        requires std::floating_point<S>
    {
        for (int a = 0; a < D; ++a)
            if (!(rounding > 0 && rounding < half_extents[a]))
                throw firn::parameter_error(firn::sentence("The rounding of a rounded box is ", rounding,
                                                           " m; it must be above 0 and below its half extents."));
    }
    double extent() const
        requires std::floating_point<S>
    {
        return norm(firn::cast<double>(half_extents));
    }

    /// All points at most `rounding` from a smaller box. [m]
    S signed_distance(const firn::Vec<S, D>& x) const { return core().signed_distance(x) - rounding; }
    firn::Vec<S, D> normal(const firn::Vec<S, D>& x) const { return core().normal(x); }

private:
    firn::Box<S, D> core() const { return {half_extents - firn::Vec<S, D>::filled(rounding)}; }
};
