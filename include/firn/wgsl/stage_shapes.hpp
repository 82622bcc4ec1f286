/// \file Translates C++ structs to WGSL structs: those that P2G and G2P use, and the states of materials.
#pragma once

#include <firn/boundary/at_once.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/material/surroundings.hpp>
#include <firn/stage/fixed_point.hpp>
#include <firn/stage/g2p.hpp>
#include <firn/stage/mirror.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/stage/volume_filter.hpp>
#include <firn/transfer/concept.hpp>
#include <firn/wgsl/recorded.hpp>

namespace firn::inline FIRN_BUILD::wgsl {

namespace detail {

/// A struct's name in WGSL and its members.
template <class... Members>
struct Described {
    std::string name;
    std::tuple<Members...> members;
};
template <class... Members>
Described<Members...> described(const std::string& name, const Members&... members) {
    return {name, {members...}};
}

// struct_of() describes the structs that P2G and G2P use.

/// A node's velocity, and the surfaces that hold it.
template <class S>
auto struct_of(const firn::detail::HeldNode<S>*) {
    using T = firn::detail::HeldNode<S>;
    return described("HeldNode", member{"velocity", &T::velocity}, member{"normal", &T::normal},
                     member{"bound", &T::bound}, member{"number", &T::number}, member{"push", &T::push},
                     member{"friction", &T::friction}, member{"count", &T::count});
}

/// The values of a particle that P2G reads.
template <class S, int D>
auto struct_of(const P2GParticle<S, D>*) {
    using T = P2GParticle<S, D>;
    return described("P2GParticle", member{"mass", &T::mass}, member{"volume", &T::volume},
                     member{"velocity", &T::velocity}, member{"affine", &T::affine}, member{"stress", &T::stress});
}

/// The values from which a particle's contributions to nodes are computed.
template <class S, int D>
auto struct_of(const P2GRecord<S, D>*) {
    using T = P2GRecord<S, D>;
    return described("P2GRecord", member{"mass", &T::mass}, member{"momentum", &T::momentum},
                     member{"affine", &T::affine}, member{"gradient", &T::gradient});
}

/// A particle's contribution to a node while the node's offset is chosen axis by axis.
template <class V, int Open, bool Gradients>
auto struct_of(const OpenRecord<V, Open, Gradients>*) {
    using T = OpenRecord<V, Open, Gradients>;
    return described("OpenRecord" + std::to_string(Open), member{"value", &T::value}, member{"column", &T::column},
                     member{"gradient", &T::gradient});
}

/// Sums over the nodes along some axes.
template <class V, int Closed, bool Moments, bool Gradients>
auto struct_of(const PartialSums<V, Closed, Moments, Gradients>*) {
    using T = PartialSums<V, Closed, Moments, Gradients>;
    return described((std::same_as<V, Vec<recorded, 4>> ? "QuadSums" : "Sums") + std::to_string(Closed),
                     member{"value", &T::value}, member{"moment", &T::moment}, member{"gradient", &T::gradient});
}

/// The values of a particle that G2P computes from the grid.
template <class S, int D>
auto struct_of(const G2PResult<S, D>*) {
    using T = G2PResult<S, D>;
    return described("G2PResult", member{"velocity", &T::velocity}, member{"affine", &T::affine},
                     member{"velocity_gradient", &T::velocity_gradient});
}

/// The velocities of a particle after a step.
template <class S, int D>
auto struct_of(const ParticleVelocity<S, D>*) {
    using T = ParticleVelocity<S, D>;
    return described("ParticleVelocity", member{"velocity", &T::velocity}, member{"motion", &T::motion});
}

/// A material's state and the stress in this state.
template <class State, class S, int D>
auto struct_of(const StateAndStress<State, S, D>*) {
    using T = StateAndStress<State, S, D>;
    return described("StateAndStress", member{"state", &T::state}, member{"stress", &T::stress});
}

/// A particle after a filter of volume ratios.
template <class State, class S, int D>
auto struct_of(const FilteredState<State, S, D>*) {
    using T = FilteredState<State, S, D>;
    return described("FilteredState", member{"state", &T::state}, member{"stress", &T::stress});
}

/// The new position of a particle.
template <class S, int D>
auto struct_of(const G2PMove<S, D>*) {
    using T = G2PMove<S, D>;
    return described("G2PMove", member{"position", &T::position}, member{"outside", &T::outside});
}

/// Maxima over the particles from which the bounds of the sums at nodes follow.
template <class S>
auto struct_of(const FixedPointLoad<S>*) {
    using T = FixedPointLoad<S>;
    return described("FixedPointLoad", member{"momentum", &T::momentum}, member{"gradient", &T::gradient},
                     member{"mass", &T::mass}, member{"particles", &T::particles});
}

/// Upper bounds of the sums at a node.
template <class S>
auto struct_of(const FixedPointBound<S>*) {
    using T = FixedPointBound<S>;
    return described("FixedPointBound", member{"momentum", &T::momentum}, member{"mass", &T::mass},
                     member{"contributions", &T::contributions});
}

/// How many quanta make one unit of momentum or mass.
template <class S>
auto struct_of(const FixedPointScale<S>*) {
    using T = FixedPointScale<S>;
    return described("FixedPointScale", member{"momentum", &T::momentum}, member{"mass", &T::mass});
}

/// Three nodes in a line across a wall.
template <class S, int D>
auto struct_of(const NodeColumn<S, D>*) {
    using T = NodeColumn<S, D>;
    return described("NodeColumn", member{"behind", &T::behind}, member{"on", &T::on}, member{"front", &T::front},
                     member{"mass_behind", &T::mass_behind}, member{"mass_on", &T::mass_on},
                     member{"mass_front", &T::mass_front});
}

/// The time that is left, in two numbers.
template <class S>
auto struct_of(const TimeLeft<S>*) {
    using T = TimeLeft<S>;
    return described("TimeLeft", member{"high", &T::high}, member{"low", &T::low});
}

/// The time that a run has reached, in two numbers.
template <class S>
auto struct_of(const TimeReached<S>*) {
    using T = TimeReached<S>;
    return described("TimeReached", member{"high", &T::high}, member{"low", &T::low});
}

/// Where and when a particle is.
template <class S, int D>
auto struct_of(const Surroundings<S, D>*) {
    using T = Surroundings<S, D>;
    return described("Surroundings", member{"position", &T::position}, member{"velocity", &T::velocity},
                     member{"cell_size", &T::cell_size}, member{"time", &T::time}, member{"density", &T::density});
}

/// What a grid of distances has at a place.
template <class S, int D>
auto struct_of(const firn::detail::FoundInGrid<S, D>*) {
    using T = firn::detail::FoundInGrid<S, D>;
    return described("FoundInGrid", member{"distance", &T::distance}, member{"normal", &T::normal});
}

/// A step and the time that is left after it.
template <class S>
auto struct_of(const StepWithin<S>*) {
    using T = StepWithin<S>;
    return described("StepWithin", member{"step", &T::step}, member{"left", &T::left});
}

template <class T>
concept has_struct_of = requires(const T* of) { struct_of(of); };

}  // namespace detail

/// Translates a struct that P2G or G2P uses to a WGSL struct.
template <detail::has_struct_of T>
struct shape<T> : struct_shape<T, shape<T>> {
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return detail::struct_of(static_cast<const T*>(nullptr)).name; }
    static auto members() { return detail::struct_of(static_cast<const T*>(nullptr)).members; }
    /// @}
};

/// Translates where a grid of distances lies to a WGSL struct. Its last two members count numbers of a buffer.
template <int D>
struct shape<firn::detail::GridInProgram<recorded, D>> {
    using Grid = firn::detail::GridInProgram<recorded, D>;  ///< the C++ struct
    /// \name Interface of shape
    /// @{

    /// type(), declare(), visit() and build() are described at the template shape.
    static std::string type() { return "GridOfDistances"; }
    template <class Add>
    static void declare(const Add& add) {
        const std::string vector = "vec" + std::to_string(D);
        add(type(), "struct " + type() + " {\n    lower: " + vector + "<f32>,\n    nodes: " + vector +
                        "<f32>,\n    spacing: f32,\n    per_spacing: f32,\n    strides: " + vector +
                        "<u32>,\n    first: u32,\n}\n");
    }
    template <class F>
    static void visit(Grid& value, const std::string& text, const F& f) {
        const auto visit_one = [&](const auto& of) {
            auto& one = of.of(value);
            shape<std::remove_cvref_t<decltype(one)>>::visit(one, text + "." + of.name, f);
        };
        std::apply([&](const auto&... of) { (visit_one(of), ...); }, Grid::parameters());
    }
    template <class F>
    static std::string build(const Grid& value, const F& f) {
        const std::string lower = vector("f32", value.lower, f), nodes = vector("f32", value.nodes, f);
        const std::string spacing = f(value.spacing), per_spacing = f(value.per_spacing);
        const std::string strides = vector("u32", value.strides, f);
        return type() + "(" + detail::joined({lower, nodes, spacing, per_spacing, strides, f(value.first)}, ", ") + ")";
    }
    /// @}

private:
    /// Returns the WGSL expression of a vector: a short one if its components are those of one vector.
    template <class F>
    static std::string vector(const char* number, const Vec<recorded, D>& value, const F& f) {
        std::vector<std::string> parts;
        for (int a = 0; a < D; ++a) parts.push_back(f(value[a]));
        const std::string whole = parts[0].substr(0, parts[0].size() - 2);
        for (int a = 0; a < D; ++a)
            if (parts[std::size_t(a)] != whole + "." + "xyz"[a])
                return sentence("vec", D, "<", number, ">(", detail::joined(parts, ", "), ")");
        return whole;
    }
};

/// The variables of a loop over a node and the shares of its demands. There is no WGSL type: no function takes one.
template <class S>
struct shape<firn::detail::SharedNode<S>> {
    /// Calls f(component, expression) for every component. \see shape
    template <class F>
    static void visit(firn::detail::SharedNode<S>& value, const std::string& text, const F& f) {
        shape<firn::detail::HeldNode<S>>::visit(value, text, f);
        for (std::size_t k = 0; k < value.shares.size(); ++k)
            shape<Vec<S, 3>>::visit(value.shares[k], text + ".shares[" + std::to_string(k) + "]", f);
    }
};

/// Translates a deformation gradient F to the WGSL matrix F − I.
template <class S, int D>
struct shape<DeformationGradient<S, D>> : detail::plain_shape<S> {
    using OfMatrix = shape<Mat<S, D>>;  ///< the matrix F − I
    /// \name Interface of shape
    /// @{

    /// type(), visit() and build() are described at the template shape.
    static std::string type() { return OfMatrix::type(); }
    template <class F>
    static void visit(DeformationGradient<S, D>& value, const std::string& text, const F& f) {
        Mat<S, D> H = displacement_gradient(value);
        OfMatrix::visit(H, text, f);
        value = DeformationGradient<S, D>::from_displacement(H);
    }
    template <class F>
    static std::string build(const DeformationGradient<S, D>& value, const F& f) {
        return OfMatrix::build(displacement_gradient(value), f);
    }
    /// @}
};

/// Translates a volume ratio J to the WGSL number J − 1.
template <class S>
struct shape<VolumeRatio<S>> : detail::plain_shape<S> {
    /// \name Interface of shape
    /// @{

    /// type(), visit() and build() are described at the template shape.
    static std::string type() { return shape<S>::type(); }
    template <class F>
    static void visit(VolumeRatio<S>& value, const std::string& text, const F& f) {
        shape<S>::visit(value.excess, text, f);
    }
    template <class F>
    static std::string build(const VolumeRatio<S>& value, const F& f) {
        return shape<S>::build(value.excess, f);
    }
    /// @}
};

/// Translates the state of a material to the WGSL struct State. T is a state if it has a function fields(); see
/// material/concept.hpp
template <class T>
    requires requires { T::fields(); }
struct shape<T> : struct_shape<T, shape<T>> {
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "State"; }
    static constexpr auto members() {
        return std::apply([](const auto&... field) { return std::tuple{member{field.name, field.member}...}; },
                          T::fields());
    }
    /// @}
};

}  // namespace firn::inline FIRN_BUILD::wgsl
