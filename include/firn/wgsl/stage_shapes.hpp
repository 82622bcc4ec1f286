/// \file Translates C++ structs to WGSL structs: those that P2G and G2P use, and the states of materials.
#pragma once

#include <firn/boundary/at_once.hpp>
#include <firn/material/concept.hpp>
#include <firn/stage/fixed_point.hpp>
#include <firn/stage/g2p.hpp>
#include <firn/stage/mirror.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/stage/volume_filter.hpp>
#include <firn/wgsl/recorded.hpp>

namespace firn::inline FIRN_BUILD::wgsl {

/// Translates HeldNode (a node's velocity, and the surfaces that hold it) to a WGSL struct.
template <class S>
struct shape<firn::detail::HeldNode<S>> : struct_shape<firn::detail::HeldNode<S>, shape<firn::detail::HeldNode<S>>> {
    using T = firn::detail::HeldNode<S>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "HeldNode"; }
    static constexpr auto members() {
        return std::tuple{member{"velocity", &T::velocity}, member{"normal", &T::normal},
                          member{"bound", &T::bound},       member{"number", &T::number},
                          member{"push", &T::push},         member{"friction", &T::friction},
                          member{"count", &T::count}};
    }
    /// @}
};

/// Translates P2GParticle (the values of a particle that P2G reads) to a WGSL struct.
template <class S, int D>
struct shape<P2GParticle<S, D>> : struct_shape<P2GParticle<S, D>, shape<P2GParticle<S, D>>> {
    using T = P2GParticle<S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "P2GParticle"; }
    static constexpr auto members() {
        return std::tuple{member{"mass", &T::mass}, member{"volume", &T::volume}, member{"velocity", &T::velocity},
                          member{"affine", &T::affine}, member{"stress", &T::stress}};
    }
    /// @}
};

/// Translates P2GRecord (the values from which a particle's contributions to nodes are computed) to a WGSL struct.
template <class S, int D>
struct shape<P2GRecord<S, D>> : struct_shape<P2GRecord<S, D>, shape<P2GRecord<S, D>>> {
    using T = P2GRecord<S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "P2GRecord"; }
    static constexpr auto members() {
        return std::tuple{member{"mass", &T::mass}, member{"momentum", &T::momentum}, member{"affine", &T::affine},
                          member{"gradient", &T::gradient}};
    }
    /// @}
};

/// Translates OpenRecord (a particle's contribution to a node while the node's offset is chosen axis by axis) to a WGSL
/// struct.
template <class V, int Open, bool Gradients>
struct shape<OpenRecord<V, Open, Gradients>>
    : struct_shape<OpenRecord<V, Open, Gradients>, shape<OpenRecord<V, Open, Gradients>>> {
    using T = OpenRecord<V, Open, Gradients>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "OpenRecord" + std::to_string(Open); }
    static constexpr auto members() {
        return std::tuple{member{"value", &T::value}, member{"column", &T::column}, member{"gradient", &T::gradient}};
    }
    /// @}
};

/// Translates PartialSums (sums over the nodes along some axes) to a WGSL struct.
template <class V, int Closed, bool Moments, bool Gradients>
struct shape<PartialSums<V, Closed, Moments, Gradients>>
    : struct_shape<PartialSums<V, Closed, Moments, Gradients>, shape<PartialSums<V, Closed, Moments, Gradients>>> {
    using T = PartialSums<V, Closed, Moments, Gradients>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() {
        return (std::same_as<V, Vec<recorded, 4>> ? "QuadSums" : "Sums") + std::to_string(Closed);
    }
    static constexpr auto members() {
        return std::tuple{member{"value", &T::value}, member{"moment", &T::moment}, member{"gradient", &T::gradient}};
    }
    /// @}
};

/// Translates G2PResult (the values of a particle that G2P computes from the grid) to a WGSL struct.
template <class S, int D>
struct shape<G2PResult<S, D>> : struct_shape<G2PResult<S, D>, shape<G2PResult<S, D>>> {
    using T = G2PResult<S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "G2PResult"; }
    static constexpr auto members() {
        return std::tuple{member{"velocity", &T::velocity}, member{"affine", &T::affine},
                          member{"velocity_gradient", &T::velocity_gradient}};
    }
    /// @}
};

/// Translates StateAndStress (a material's state and the stress in this state) to a WGSL struct.
template <class State, class S, int D>
struct shape<StateAndStress<State, S, D>>
    : struct_shape<StateAndStress<State, S, D>, shape<StateAndStress<State, S, D>>> {
    using T = StateAndStress<State, S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "StateAndStress"; }
    static constexpr auto members() { return std::tuple{member{"state", &T::state}, member{"stress", &T::stress}}; }
    /// @}
};

/// Translates FilteredState (a particle after a filter of volume ratios) to a WGSL struct.
template <class State, class S, int D>
struct shape<FilteredState<State, S, D>> : struct_shape<FilteredState<State, S, D>, shape<FilteredState<State, S, D>>> {
    using T = FilteredState<State, S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "FilteredState"; }
    static constexpr auto members() { return std::tuple{member{"state", &T::state}, member{"stress", &T::stress}}; }
    /// @}
};

/// Translates G2PMove (the new position of a particle) to a WGSL struct.
template <class S, int D>
struct shape<G2PMove<S, D>> : struct_shape<G2PMove<S, D>, shape<G2PMove<S, D>>> {
    using T = G2PMove<S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "G2PMove"; }
    static constexpr auto members() {
        return std::tuple{member{"position", &T::position}, member{"outside", &T::outside}};
    }
    /// @}
};

/// Translates FixedPointLoad (maxima over the particles from which the bounds of the sums at nodes follow) to a WGSL
/// struct.
template <class S>
struct shape<FixedPointLoad<S>> : struct_shape<FixedPointLoad<S>, shape<FixedPointLoad<S>>> {
    using T = FixedPointLoad<S>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "FixedPointLoad"; }
    static constexpr auto members() {
        return std::tuple{member{"momentum", &T::momentum}, member{"gradient", &T::gradient}, member{"mass", &T::mass},
                          member{"particles", &T::particles}};
    }
    /// @}
};

/// Translates FixedPointBound (upper bounds of the sums at a node) to a WGSL struct.
template <class S>
struct shape<FixedPointBound<S>> : struct_shape<FixedPointBound<S>, shape<FixedPointBound<S>>> {
    using T = FixedPointBound<S>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "FixedPointBound"; }
    static constexpr auto members() {
        return std::tuple{member{"momentum", &T::momentum}, member{"mass", &T::mass},
                          member{"contributions", &T::contributions}};
    }
    /// @}
};

/// Translates FixedPointScale (how many quanta make one unit of momentum or mass) to a WGSL struct.
template <class S>
struct shape<FixedPointScale<S>> : struct_shape<FixedPointScale<S>, shape<FixedPointScale<S>>> {
    using T = FixedPointScale<S>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "FixedPointScale"; }
    static constexpr auto members() { return std::tuple{member{"momentum", &T::momentum}, member{"mass", &T::mass}}; }
    /// @}
};

/// Translates NodeColumn (three nodes in a line across a wall) to a WGSL struct.
template <class S, int D>
struct shape<NodeColumn<S, D>> : struct_shape<NodeColumn<S, D>, shape<NodeColumn<S, D>>> {
    using T = NodeColumn<S, D>;  ///< the C++ struct
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL; members() returns its members. \see struct_shape
    static std::string name() { return "NodeColumn"; }
    static constexpr auto members() {
        return std::tuple{member{"behind", &T::behind},   member{"on", &T::on},
                          member{"front", &T::front},     member{"mass_behind", &T::mass_behind},
                          member{"mass_on", &T::mass_on}, member{"mass_front", &T::mass_front}};
    }
    /// @}
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
