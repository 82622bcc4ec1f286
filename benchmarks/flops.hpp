/// \file The work of a step, counted: the stages run on one particle with a scalar that counts its operations.
#pragma once

#include <firn/firn.hpp>

namespace scenes {

/// A float that counts additions, multiplications, divisions and roots as one operation each. Comparisons, choices and
/// changes of sign are free.
struct Counted {
    float value;
    inline static long operations = 0;

    Counted() = default;
    template <class U>
        requires std::is_arithmetic_v<U>
    constexpr Counted(U v) : value(float(v)) {}

    static Counted result(float v) {
        ++operations;
        return v;
    }
    friend Counted operator+(Counted a, Counted b) { return result(a.value + b.value); }
    friend Counted operator-(Counted a, Counted b) { return result(a.value - b.value); }
    friend Counted operator*(Counted a, Counted b) { return result(a.value * b.value); }
    friend Counted operator/(Counted a, Counted b) { return result(a.value / b.value); }
    friend Counted operator-(Counted a) { return -a.value; }
    friend bool operator<(Counted a, Counted b) { return a.value < b.value; }
    friend bool operator<=(Counted a, Counted b) { return a.value <= b.value; }
    friend bool operator>(Counted a, Counted b) { return a.value > b.value; }
    friend bool operator>=(Counted a, Counted b) { return a.value >= b.value; }
    friend bool operator==(Counted a, Counted b) { return a.value == b.value; }
    friend Counted select(bool mask, Counted a, Counted b) { return mask ? a : b; }
    friend Counted sqrt(Counted a) { return result(std::sqrt(a.value)); }
    friend Counted abs(Counted a) { return std::abs(a.value); }
    friend Counted floor(Counted a) { return std::floor(a.value); }
    /// On the CPU, nothing is to do. \see firn/math/deformation.hpp
    friend Counted excess_of(Counted, Counted excess) { return excess; }
};

}  // namespace scenes

template <>
struct firn::scalar_traits<scenes::Counted> {
    using value_type = float;
    static constexpr int lanes = 1;
};

namespace scenes {

/// The 27 nodes around a particle, one after the other.
struct NodeWalk {
    using S = Counted;
    using Weights = std::array<std::array<S, 3>, 3>;
    using Node = firn::Vec<S, 4>;  ///< momentum and mass

    const Weights& w;
    Node nodes[27];
    int next = 0;

    /// A record closed along its last open axis at three offsets, and each result so on; at a node it is added.
    template <int Open>
    void scatter(const firn::OpenRecord<Node, Open, false>& record) {
        if constexpr (Open == 0) {
            nodes[next++] += record.value;
        } else {
            firn::unroll<3>(
                [&](auto k) { scatter(record.contract(std::integral_constant<int, k - 1>{}, w[Open - 1][k], S(0))); });
        }
    }
    template <int Closed>
    firn::PartialSums<firn::Vec<S, 3>, Closed, true, false> gather() {
        firn::PartialSums<firn::Vec<S, 3>, Closed, true, false> sums;
        if constexpr (Closed == 0) {
            const Node& node = nodes[next++];
            sums.value = {{node.v[0], node.v[1], node.v[2]}};
        } else {
            const std::array parts{gather<Closed - 1>(), gather<Closed - 1>(), gather<Closed - 1>()};
            sums = firn::sum_axis<1>(parts, w[Closed - 1], w[Closed - 1]);
        }
        return sums;
    }
};

/// Operations of P2G and G2P for one particle in 3D with quadratic B-splines, APIC, MLS forces and fixed corotated
/// elasticity; the grid update, shared by all particles of a cell, and the time step's bound are left out.
inline long operations_of_a_particle_step() {
    using S = Counted;
    using Kernel = firn::QuadraticBSpline;
    const firn::FixedCorotated<S> material{S(400), S(600)};
    const S h = 1, dt = 1;
    firn::ElasticState<S, 3> state;
    state.F(0, 1) = 0.1f;
    firn::P2GParticle<S, 3> particle{};
    particle.mass = particle.volume = 1;
    particle.stress = material.kirchhoff_stress(state.F);

    Counted::operations = 0;
    for (int pass = 0; pass < 2; ++pass) {  // P2G and G2P find the particle's place each
        firn::Vec<S, 3> d{};
        NodeWalk::Weights w;
        for (int a = 0; a < 3; ++a) {
            const S x = S(10.3f) * S(1), f = x - S(9);  // in cells, from the first node
            w[std::size_t(a)] = Kernel::weights(f);
            d[a] = f - S(1);
        }
        NodeWalk walk{w, {}};
        if (pass == 0) {
            const auto record = firn::make_record<Kernel, firn::Apic, firn::MlsForce>(particle, d, h, dt);
            firn::OpenRecord<NodeWalk::Node, 3, false> open{};
            for (int i = 0; i < 3; ++i) {
                open.value[i] = record.momentum[i];
                for (std::size_t a = 0; a < 3; ++a) open.column[a][i] = record.affine(i, int(a));
            }
            open.value[3] = record.mass;
            walk.scatter(open);
        } else {
            const auto sums = walk.gather<3>();
            const auto taken = firn::take_from_grid<Kernel, firn::Apic, firn::MlsForce>(
                firn::G2PSums<S, 3>{sums.value,
                                    firn::Mat<S, 3>::rows(sums.moment[0][0], sums.moment[1][0], sums.moment[2][0],
                                                          sums.moment[0][1], sums.moment[1][1], sums.moment[2][1],
                                                          sums.moment[0][2], sums.moment[1][2], sums.moment[2][2]),
                                    {}},
                d, h);
            state = firn::updated(material, state, taken.velocity_gradient, dt);
            particle.stress = kirchhoff_stress(material, state);
            firn::Vec<S, 3> x{};
            x += taken.velocity * dt;
        }
    }
    return Counted::operations;
}

}  // namespace scenes
