/// \file Translates the structs that P2G and G2P use, and the states of materials, to structs of WGSL.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/stage/fixed_point.hpp>
#include <firn/stage/g2p.hpp>
#include <firn/stage/p2g.hpp>
#include <firn/wgsl/recorded.hpp>

namespace firn::wgsl {

/// Translates P2GParticle to a struct of WGSL.
template <class S, int D>
struct shape<P2GParticle<S, D>> : struct_shape<P2GParticle<S, D>, shape<P2GParticle<S, D>>> {
    using T = P2GParticle<S, D>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "P2GParticle"; }
    static constexpr auto members() {
        return std::tuple{member{"mass", &T::mass}, member{"volume", &T::volume}, member{"velocity", &T::velocity},
                          member{"affine", &T::affine}, member{"stress", &T::stress}};
    }
    /// @}
};

/// Translates P2GRecord to a struct of WGSL.
template <class S, int D>
struct shape<P2GRecord<S, D>> : struct_shape<P2GRecord<S, D>, shape<P2GRecord<S, D>>> {
    using T = P2GRecord<S, D>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "P2GRecord"; }
    static constexpr auto members() {
        return std::tuple{member{"mass", &T::mass}, member{"momentum", &T::momentum}, member{"affine", &T::affine},
                          member{"gradient", &T::gradient}};
    }
    /// @}
};

/// Translates OpenRecord to a struct of WGSL.
template <class V, int Open, bool Gradients>
struct shape<OpenRecord<V, Open, Gradients>>
    : struct_shape<OpenRecord<V, Open, Gradients>, shape<OpenRecord<V, Open, Gradients>>> {
    using T = OpenRecord<V, Open, Gradients>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "OpenRecord" + std::to_string(Open); }
    static constexpr auto members() {
        return std::tuple{member{"value", &T::value}, member{"column", &T::column}, member{"gradient", &T::gradient}};
    }
    /// @}
};

/// Translates PartialSums to a struct of WGSL.
template <class V, int Closed, bool Moments, bool Gradients>
struct shape<PartialSums<V, Closed, Moments, Gradients>>
    : struct_shape<PartialSums<V, Closed, Moments, Gradients>, shape<PartialSums<V, Closed, Moments, Gradients>>> {
    using T = PartialSums<V, Closed, Moments, Gradients>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "Sums" + std::to_string(Closed); }
    static constexpr auto members() {
        return std::tuple{member{"value", &T::value}, member{"moment", &T::moment}, member{"gradient", &T::gradient}};
    }
    /// @}
};

/// Translates G2PResult to a struct of WGSL.
template <class S, int D>
struct shape<G2PResult<S, D>> : struct_shape<G2PResult<S, D>, shape<G2PResult<S, D>>> {
    using T = G2PResult<S, D>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "G2PResult"; }
    static constexpr auto members() {
        return std::tuple{member{"velocity", &T::velocity}, member{"affine", &T::affine},
                          member{"velocity_gradient", &T::velocity_gradient}};
    }
    /// @}
};

/// Translates StateAndStress to a struct of WGSL.
template <class State, class S, int D>
struct shape<StateAndStress<State, S, D>>
    : struct_shape<StateAndStress<State, S, D>, shape<StateAndStress<State, S, D>>> {
    using T = StateAndStress<State, S, D>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "StateAndStress"; }
    static constexpr auto members() { return std::tuple{member{"state", &T::state}, member{"stress", &T::stress}}; }
    /// @}
};

/// Translates G2PMove to a struct of WGSL.
template <class S, int D>
struct shape<G2PMove<S, D>> : struct_shape<G2PMove<S, D>, shape<G2PMove<S, D>>> {
    using T = G2PMove<S, D>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "G2PMove"; }
    static constexpr auto members() {
        return std::tuple{member{"position", &T::position}, member{"outside", &T::outside}};
    }
    /// @}
};

/// Translates FixedPointLoad to a struct of WGSL.
template <class S>
struct shape<FixedPointLoad<S>> : struct_shape<FixedPointLoad<S>, shape<FixedPointLoad<S>>> {
    using T = FixedPointLoad<S>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "FixedPointLoad"; }
    static constexpr auto members() {
        return std::tuple{member{"momentum", &T::momentum}, member{"gradient", &T::gradient}, member{"mass", &T::mass},
                          member{"particles", &T::particles}};
    }
    /// @}
};

/// Translates FixedPointBound to a struct of WGSL.
template <class S>
struct shape<FixedPointBound<S>> : struct_shape<FixedPointBound<S>, shape<FixedPointBound<S>>> {
    using T = FixedPointBound<S>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "FixedPointBound"; }
    static constexpr auto members() {
        return std::tuple{member{"momentum", &T::momentum}, member{"mass", &T::mass},
                          member{"contributions", &T::contributions}};
    }
    /// @}
};

/// Translates FixedPointScale to a struct of WGSL.
template <class S>
struct shape<FixedPointScale<S>> : struct_shape<FixedPointScale<S>, shape<FixedPointScale<S>>> {
    using T = FixedPointScale<S>;  ///< the struct in C++
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "FixedPointScale"; }
    static constexpr auto members() { return std::tuple{member{"momentum", &T::momentum}, member{"mass", &T::mass}}; }
    /// @}
};

/// Translates the state of a material, a type with fields(), to the WGSL struct State. \see material/concept.hpp
template <class T>
    requires requires { T::fields(); }
struct shape<T> : struct_shape<T, shape<T>> {
    /// \name Interface of struct_shape
    /// @{

    /// name() returns the struct's name in WGSL, members() its members, as struct_shape needs them.
    static std::string name() { return "State"; }
    static constexpr auto members() {
        return std::apply([](const auto&... field) { return std::tuple{member{field.name, field.member}...}; },
                          T::fields());
    }
    /// @}
};

}  // namespace firn::wgsl
