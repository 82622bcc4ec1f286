/// \file Contact at one node: momentum, energy, friction, the rule for more than two groups, and a law of a user's own.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/scenes.hpp"
#include <firn/contact/coulomb.hpp>
#include <firn/contact/one_field.hpp>
#include <firn/stage/contact.hpp>

#include <algorithm>
#include <vector>

namespace contact_node_tests {

using namespace firn;

/// A node at which groups meet, and all their pairs.
template <int D>
struct Node {
    std::vector<GroupAtNode<D>> groups;
    std::vector<PairAtNode<D>> pairs;

    Vec<double, D> momentum() const {
        Vec<double, D> sum = Vec<double, D>::zero();
        for (const auto& group : groups) sum += group.momentum;
        return sum;
    }
    double energy() const {
        double sum = 0;
        for (const auto& group : groups) sum += dot(group.momentum, group.momentum) / (2 * group.mass);
        return sum;
    }
    double size() const {
        double sum = 0;
        for (const auto& group : groups) sum += std::sqrt(dot(group.momentum, group.momentum));
        return sum;
    }
};

/// Masses over twelve orders of magnitude, random velocities, normals and gaps.
template <int D>
Node<D> random_node(std::uint64_t seed, std::size_t count) {
    std::uint64_t next = 1000 * seed;
    const auto random = [&] { return 2 * scenes::noise(next++) - 1; };
    Node<D> node;
    for (std::size_t i = 0; i < count; ++i) {
        GroupAtNode<D> group{int(3 * i), std::pow(10.0, 6 * random()), {}};
        for (int a = 0; a < D; ++a) group.momentum[a] = group.mass * random();
        node.groups.push_back(group);
    }
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = i + 1; k < count; ++k) {
            Vec<double, D> normal;
            for (int a = 0; a < D; ++a) normal[a] = random();
            node.pairs.push_back({i, k, normal * (1 / std::sqrt(dot(normal, normal))), 1e-3 * random()});
        }
    return node;
}

template <int D>
void check_random_nodes(const CoulombContact& law) {
    double worst_momentum = 0, worst_gain = 0;
    int changed = 0;
    constexpr int count = test_support::fewer_if_quick(50'000, 5'000);
    for (std::uint64_t seed = 0; seed < count; ++seed) {
        Node<D> node = random_node<D>(seed, 2 + seed % 7);
        const Node<D> before = node;
        meet(law, std::span(node.groups), std::span(node.pairs), 0.01, 1e-3);
        const Vec<double, D> lost = node.momentum() - before.momentum();
        worst_momentum = std::max(worst_momentum, std::sqrt(dot(lost, lost)) / before.size());
        worst_gain = std::max(worst_gain, node.energy() / before.energy() - 1);
        changed += node.energy() < before.energy();
        // The impulses of the pairs are those of the groups.
        for (const PairAtNode<D>& pair : node.pairs) {
            node.groups[pair.first].momentum -= pair.impulse;
            node.groups[pair.second].momentum += pair.impulse;
        }
        for (std::size_t i = 0; i < node.groups.size(); ++i) {
            const Vec<double, D> left = node.groups[i].momentum - before.groups[i].momentum;
            worst_momentum = std::max(worst_momentum, std::sqrt(dot(left, left)) / before.size());
        }
    }
    CHECK(worst_momentum < 1e-14);
    CHECK(worst_gain < 1e-14);
    CHECK(changed > count / 2);
}

TEST_CASE("Impulses at 10⁵ random nodes of 2 to 8 groups keep momentum and never raise the kinetic energy") {
    CoulombContact rough{.friction = 0.4};
    rough.set_pair(0, 3, {.contact = Contact::stick});
    rough.set_pair(6, 3, {.contact = Contact::slip, .friction = 2});
    check_random_nodes<2>(rough);
    check_random_nodes<3>(rough);
}

Node<2> two_groups(const Vec<double, 2>& velocity, double gap) {
    return {{{1, 2.0, velocity * 2.0}, {4, 6.0, {0, 0}}}, {{0, 1, {0, 1}, gap}}};
}
/// Returns the velocity of the first group relative to the second after contact.
Vec<double, 2> relative(const CoulombContact& law, const Vec<double, 2>& velocity, double gap) {
    Node<2> node = two_groups(velocity, gap);
    meet(law, std::span(node.groups), std::span(node.pairs), 0.1, 0.01);
    return node.groups[0].momentum * (1 / 2.0) - node.groups[1].momentum * (1 / 6.0);
}

TEST_CASE("Two groups: no penetration, free parting, and Coulomb friction") {
    const CoulombContact law{.friction = 0.3};
    CHECK(norm(relative(law, {1, -2}, 0) - Vec<double, 2>{0.4, 0}) < 1e-15);      // slides: 1 − 0.3 · 2
    CHECK(norm(relative(law, {0.5, -2}, 0) - Vec<double, 2>{0, 0}) < 1e-15);      // sticks
    CHECK(norm(relative(law, {1, 2}, -0.01) - Vec<double, 2>{1, 2}) == 0);        // parts, untouched to the bit
    CHECK(norm(relative(law, {1, -2}, 0.03) - Vec<double, 2>{1, -2}) == 0);       // the gap does not close in 0.01 s
    CHECK(norm(relative(law, {1, -2}, 0.01) - Vec<double, 2>{0.7, -1}) < 1e-15);  // it closes, and no further
}

TEST_CASE("Two groups that stick or slip part no more once they have touched") {
    CoulombContact law;
    law.set_pair(4, 1, {.contact = Contact::stick, .reach = 0.2});
    CHECK(norm(relative(law, {1, 2}, 0.019)) < 1e-15);
    CHECK(norm(relative(law, {1, 2}, 0.021) - Vec<double, 2>{1, 2}) == 0);
    law.pairs[0].contact.contact = Contact::slip;
    CHECK(norm(relative(law, {1, 2}, 0) - Vec<double, 2>{1, 0}) < 1e-15);
    law.pairs[0].contact.contact = Contact::none;
    CHECK(norm(relative(law, {1, -2}, 0) - Vec<double, 2>{1, -2}) == 0);
}

TEST_CASE("More than two groups: the result does not depend on their order, and most of the penetration goes") {
    const CoulombContact law{.friction = 0.5};
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        Node<2> node = random_node<2>(seed, 4), other = node;
        for (auto* each : {&node, &other})
            for (auto& group : each->groups) group.momentum = group.momentum * (1 / group.mass), group.mass = 1;
        std::reverse(other.groups.begin(), other.groups.end());
        for (auto& pair : other.pairs) {
            const std::size_t first = pair.first;
            pair.first = 3 - pair.second, pair.second = 3 - first;
            pair.normal = -pair.normal;
        }
        for (std::size_t i = 0; i < 4; ++i) other.groups[i].group = int(i);
        meet(law, std::span(node.groups), std::span(node.pairs), 0.1, 0.01);
        meet(law, std::span(other.groups), std::span(other.pairs), 0.1, 0.01);
        for (std::size_t i = 0; i < 4; ++i) CHECK(norm(node.groups[i].momentum - other.groups[3 - i].momentum) < 1e-13);
    }
    // Two heavy groups press a light one from both sides.
    Node<2> vice{{{0, 100, {0, 100}}, {1, 1, {0, 0}}, {2, 100, {0, -100}}},
                 {{0, 1, {0, -1}, 0}, {0, 2, {0, -1}, 0}, {1, 2, {0, -1}, 0}}};
    meet(law, std::span(vice.groups), std::span(vice.pairs), 0.1, 0.01);
    for (const auto& group : vice.groups) CHECK(std::abs(group.momentum[1] / group.mass) < 0.01);
}

/// A law of a user's own: cohesion that breaks. Surfaces that touch stick until the traction that parts them exceeds
/// the strength [Pa].
struct BrittleBond {
    static constexpr const char* name = "brittle_bond";
    static constexpr bool between_groups = true;
    double strength = 0;

    template <std::floating_point S, int D>
    Vec<S, D> relative_velocity(int, int, const Meeting<S, D>& at) const {
        S area = 1;
        for (int a = 1; a < D; ++a) area *= at.cell_size;
        const S pull = at.reduced_mass * dot(at.velocity, at.normal) / (at.dt * area);
        return pull > S(strength) ? at.velocity : Vec<S, D>::zero();
    }
};
static_assert(contact_law<BrittleBond> && contact_law<CoulombContact> && contact_law<OneField>);

TEST_CASE("A law of a user's own: cohesion that breaks at its strength") {
    // The impulse that stops 2 m/s between 2 kg and 6 kg is 3 N s; over 0.01 s and 0.1 m: 3000 Pa.
    for (const double strength : {2999.0, 3001.0}) {
        Node<2> node = two_groups({0, 2}, 0);
        meet(BrittleBond{strength}, std::span(node.groups), std::span(node.pairs), 0.1, 0.01);
        CHECK((node.groups[0].momentum[1] == 4) == (strength < 3000));
        CHECK(node.momentum()[1] == Approx(4));
    }
}

TEST_CASE("A contact refuses parameters that make no sense") {
    CoulombContact law;
    CHECK_THROWS_AS(law.set_pair(1, 1, {}), parameter_error);
    CHECK_THROWS_AS(law.set_pair(-1, 2, {}), parameter_error);
    CHECK_THROWS_AS(law.set_pair(1, 2, {.friction = -0.1}), parameter_error);
    law = {};
    law.set_pair(1, 2, {.friction = 0.1});
    CHECK_THROWS_AS(law.set_pair(2, 1, {.friction = 0.2}), parameter_error);
    CHECK(law.of_pair(1, 2).friction == 0.1);
    CHECK(law.of_pair(2, 1).friction == 0.1);
    CHECK_THROWS_AS(CoulombContact{.friction = std::nan("")}.check(), parameter_error);
    CHECK(CoulombContact{.friction = 0.3}.description() == "friction 0.3, normals by regression");
}

}  // namespace contact_node_tests
