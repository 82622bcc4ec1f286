/// \file A run in dual numbers: what it measures, and the derivative along a direction.
///
/// A step is written as the papers write it, by plain loops over particles and the nodes around each; policies
/// are firn's own, for dual numbers. So nothing of the way back, and none of the loops of the engine, is in it.
#pragma once

#include "support/by_definition.hpp"
#include "support/random_numbers.hpp"
#include <firn/adjoint.hpp>

#include <functional>
#include <map>
#include <stdexcept>

namespace tangent {

using namespace firn;
using T = dual<double>;

/// Writes derivatives to the numbers of a policy of dual numbers, in the order of detail::for_numbers().
template <class Lifted>
void set_derivatives(Lifted& policy, const std::vector<double>& by) {
    std::size_t next = 0;
    firn::detail::for_numbers<T>(policy, [&](T& number) { number.derivative = by.at(next++); });
}
/// Returns a policy in dual numbers. \param direction  a policy of the same kind: the derivatives
template <class Policy, class Direction>
auto lifted_along(const Policy& policy, const Direction& direction) {
    auto lifted = lift<T>(policy);
    set_derivatives(lifted, firn::detail::numbers_of(direction));
    return lifted;
}

/// A run that starts as a simulation of one material does, and its derivative.
template <class Simulation>
class Run {
    static constexpr int D = Simulation::dimension;
    using Material = typename Simulation::material_type;
    using Lifted = with_scalar_t<Material, T>;
    using State = material_state_t<Lifted, D>;
    using Boundary = decltype(Simulation::boundary);
    using Transfer = decltype(Simulation::transfer);
    using Kernel = typename Simulation::kernel_type;
    using Force = typename Simulation::force_type;
    using Volume = decltype(Simulation::volume);
    using Node = by_definition::Node<D, T>;
    using Policies = by_definition::Case<double, D, Transfer, Force, Kernel>;
    static constexpr bool blended = blends_velocities<Transfer>;

public:
    std::function<Vec<T, D>(const Vec<T, D>& x, double time)> load;  ///< of all particles; may be empty

    /// \param simulation  prepared: its first stresses are not computed here;  \param direction  of one interval
    Run(const Simulation& simulation, const Gradient<Simulation>& direction)
        : domain_(simulation.domain()),
          boundary_(simulation.boundary),
          boundary_along_(firn::detail::numbers_of(direction.intervals[0].boundary)),
          material_(lifted_along(simulation.template set<0>().material(), direction.set().material)),
          transfer_(lifted_along(simulation.transfer, direction.intervals[0].transfer)) {
        for (int a = 0; a < D; ++a) gravity_[a] = {simulation.gravity[a], direction.intervals[0].gravity[a]};
        const auto& particles = simulation.particles();
        const auto& by = direction.set();
        for (const std::uint32_t slot : slots_by_id(particles, 1)) {
            const std::uint32_t id = particles.id(slot);
            std::vector<double> along;
            const auto add = [&](const auto& numbers) {
                along.insert(along.end(), std::begin(numbers), std::end(numbers));
            };
            add(by.position[id].v), add(by.velocity[id].v);
            along.insert(along.end(), {by.mass[id], by.volume[id]});
            firn::detail::for_state(by.state[id], [&](double number) { along.push_back(number); });
            std::size_t next = 0;
            Particle p{
                firn::detail::measured<T, D, State>(particles, slot, [&](double x) { return T{x, along.at(next++)}; }),
                {},
                {}};
            for (int k = 0; k < D * D; ++k) p.affine.m[k] = {particles.affine(slot).m[k], by.affine[id].m[k]};
            p.stress = stress_of(material_, p.state, p.affine);
            particles_.push_back(p);
        }
    }

    /// Takes a step of dt [s].
    void step(double dt) {
        const double h = domain_.cell_size;
        Nodes nodes;
        if (load)
            for (Particle& p : particles_) p.velocity += load(p.position, time_) * (T(dt) / p.mass);
        time_ += dt;
        for (const Particle& p : particles_)
            for_nodes(p.position, [&](const Node& node, const auto& index) {
                Sum& sum = nodes[index];
                const auto momentum = [&](const Mat<T, D>& stress) {
                    return by_definition::momentum_to<Policies>(node, h, dt, p.mass, p.volume, p.velocity, p.affine,
                                                                stress);
                };
                sum.momentum += momentum(p.stress);
                if (blended) sum.before += momentum(Mat<T, D>::zero());
                sum.mass += p.mass * node.weight;
            });
        auto walls = lift<T>(on_grid(boundary_, h));
        set_derivatives(walls, boundary_along_);
        if constexpr (refines_velocities<Transfer>) refine(nodes, walls);
        for (auto& [index, sum] : nodes) {
            Vec<T, D> x;
            for (int a = 0; a < D; ++a) x[a] = T(domain_.lower[a] + h * index[std::size_t(a)]);
            const auto velocity = [&](const auto& boundary) {
                return node_velocity(sum.momentum, sum.mass, x, gravity_, T(dt), boundary);
            };
            sum.position = x, sum.first_mass = sum.mass, sum.without_walls = velocity(NoBoundary{});
            sum.momentum = velocity(firn::detail::AllAtOnce<decltype(walls), T>{walls, T(1)});
            sum.before = sum.before * (T(1) / sum.mass);
        }
        if constexpr (blended) mirror(nodes, &Sum::before, walls, false);
        mirror(nodes, &Sum::momentum, walls, true);
        reaction_ = {Vec<T, D>::zero(), firn::no_spin<T, D>()};
        for (const auto& [index, sum] : nodes) {
            const Vec<T, D> impulse = (sum.momentum - sum.without_walls) * sum.first_mass;
            reaction_.impulse += impulse;
            reaction_.angular_impulse += axial_product(sum.position, impulse);
        }
        if constexpr (Volume::averages_volume) sum_rates(nodes, walls);
        for (Particle& p : particles_) {
            const auto taken = by_definition::taken_from<Kernel>(
                domain_, p.position, [&](const Node& node) { return nodes.at(wrapped_index(node.index)).momentum; });
            constexpr bool moment = g2p_needs_moment<Kernel, Transfer, Force>;
            const Mat<T, D>& C = moment ? taken.affine : taken.gradient;
            Mat<T, D> L = Force::weight_gradients ? taken.gradient : C;
            if constexpr (Volume::averages_volume) {
                T average = T(0);
                for_nodes(p.position, [&](const Node& node, const auto& index) {
                    average += node.weight * nodes.at(index).rates / nodes.at(index).volume;
                });
                L = Volume::velocity_gradient(L, average);
            }
            Vec<T, D> velocity = taken.velocity, motion = velocity;
            if constexpr (blended) {
                Vec<T, D> before = Vec<T, D>::zero();
                for_nodes(p.position,
                          [&](const Node& node, const auto& index) { before += nodes.at(index).before * node.weight; });
                const auto after = transfer_.blended(velocity, before, p.velocity, L);
                velocity = after.velocity, motion = after.motion;
            }
            const auto before_update = p.state;
            if constexpr (has_stress_with_state<Lifted, D>) {
                const auto after = updated_with_stress(material_, p.state, L, T(dt));
                p.state = after.state, p.stress = after.stress;
            } else {
                p.state = updated(material_, p.state, L, T(dt));
                p.stress = stress_of(material_, p.state, L);
            }
            if constexpr (has_returned<Lifted, D>) {
                const auto trial = followed(before_update, L, T(dt)).F;
                flows_ += std::size_t(squared_norm(Mat<T, D>(trial) - Mat<T, D>(p.state.F)).value > 0);
            }
            p.velocity = velocity;
            p.position += motion * T(dt);
            if constexpr (Transfer::affine) p.affine = transfer_.affine_field(C);
        }
        auto later = lift<T>(boundary_);
        set_derivatives(later, boundary_along_);
        later = advanced(later, dt);
        boundary_along_.clear();
        firn::detail::for_numbers<T>(later, [&](const T& number) { boundary_along_.push_back(number.derivative); });
        boundary_ = advanced(boundary_, dt);
    }

    /// Returns the reaction of the whole boundary in the last step, about the origin.
    const MeasuredReaction<T, D>& reaction() const { return reaction_; }
    /// Returns how often a particle has flowed so far.
    std::size_t flows() const { return flows_; }
    /// Returns Σ f(particle), and its derivative.
    template <class F>
    T measure(const F& f) const {
        T sum = T(0);
        for (const Particle& p : particles_) sum += f(static_cast<const MeasuredParticle<T, D, State>&>(p));
        return sum;
    }

private:
    struct Particle : MeasuredParticle<T, D, State> {
        Mat<T, D> affine, stress;
    };

    /// Momentum, or velocity, and mass of a node; `before`: without forces.
    struct Sum {
        Vec<T, D> momentum = Vec<T, D>::zero(), before = Vec<T, D>::zero(), position, without_walls;
        Vec<T, D> unmirrored, first, term, carried;  ///< of the series: v_1 before walls, v_1, v_j, and A v_j
        T first_mass;
        T mass = T(0), rates = T(0), volume = T(0);  ///< rates: Σ N V0 tr ∇v; volume: Σ N V0
    };
    using Nodes = std::map<std::array<int, std::size_t(D)>, Sum>;

    /// Replaces the momenta by those of a series of velocities: v_{j+1} of v_1, v_j and A v_j. Mirrored walls act on
    /// every term; what they changed in the first one is given back in the end.
    template <class Walls>
    void refine(Nodes& nodes, const Walls& walls) const {
        for (auto& [index, sum] : nodes) sum.unmirrored = sum.term = sum.momentum * (T(1) / sum.mass);
        mirror(nodes, &Sum::term, walls, false);
        for (auto& [index, sum] : nodes) sum.first = sum.term;
        for (int j = 1; j < transfer_.order; ++j) {
            for (auto& [index, sum] : nodes) sum.carried = Vec<T, D>::zero();
            for (const Particle& p : particles_) {
                Vec<T, D> velocity = Vec<T, D>::zero();
                for_nodes(p.position,
                          [&](const Node& node, const auto& index) { velocity += nodes.at(index).term * node.weight; });
                for_nodes(p.position, [&](const Node& node, const auto& index) {
                    nodes.at(index).carried += by_definition::momentum_to<Policies>(
                        node, domain_.cell_size, 0, p.mass, p.volume, velocity, p.affine, Mat<T, D>::zero());
                });
            }
            for (auto& [index, sum] : nodes) sum.carried = sum.carried * (T(1) / sum.mass);
            mirror(nodes, &Sum::carried, walls, false);
            for (auto& [index, sum] : nodes) sum.term = Transfer::next(sum.first, sum.term, sum.carried);
        }
        for (auto& [index, sum] : nodes) sum.momentum = (sum.term + sum.unmirrored - sum.first) * sum.mass;
    }
    /// Sums the rates of volume change of particles up at the nodes.
    template <class Walls>
    void sum_rates(Nodes& nodes, const Walls& walls) const {
        for (const Particle& p : particles_) {
            const auto taken = by_definition::taken_from<Kernel>(
                domain_, p.position, [&](const Node& node) { return nodes.at(wrapped_index(node.index)).momentum; });
            const T rate = trace(g2p_needs_gradient<Kernel, Transfer, Force> ? taken.gradient : taken.affine);
            for_nodes(p.position, [&](const Node& node, const auto& index) {
                nodes.at(index).rates += node.weight * p.volume * rate;
                nodes.at(index).volume += node.weight * p.volume;
            });
        }
        if constexpr (has_mirrors<Walls>)
            walls.mirrors([&](int axis, const T& position, int, Contact, const T&, int) {
                const int on = int(std::lround((position.value - domain_.lower[axis]) / domain_.cell_size));
                for (auto& [index, sum] : nodes) {
                    if (index[std::size_t(axis)] != on + 1) continue;
                    auto other = index;
                    other[std::size_t(axis)] = on - 1;
                    const auto found = nodes.find(other);
                    if (found == nodes.end()) continue;
                    Sum& behind = found->second;
                    sum.rates = behind.rates = sum.rates + behind.rates;
                    sum.volume = behind.volume = sum.volume + behind.volume;
                }
            });
    }
    /// Lets mirrored walls act, one after the other, on columns of three nodes.
    template <class Walls>
    void mirror(Nodes& nodes, Vec<T, D> Sum::* velocity, const Walls& walls, bool with_friction) const {
        if constexpr (has_mirrors<Walls>) {
            std::map<std::array<int, std::size_t(D)>, T> masses;
            for (const auto& [index, sum] : nodes) masses[index] = sum.mass;
            walls.mirrors([&](int axis, const T& position, int inward, Contact contact, const T& friction, int) {
                const int on = int(std::lround((position.value - domain_.lower[axis]) / domain_.cell_size));
                std::map<std::array<int, std::size_t(D)>, NodeColumn<T, D>> columns;  // by their middle nodes
                const auto for_sides = [&](auto index, const auto& f) {
                    for (int side = -1; side <= 1; ++side) {
                        index[std::size_t(axis)] = on + side * inward;
                        if (const auto found = nodes.find(index); found != nodes.end())
                            f(side, found->second, masses.at(index));
                    }
                };
                for (const auto& [index, sum] : nodes) {
                    if (std::abs(index[std::size_t(axis)] - on) > 1) continue;
                    auto middle = index;
                    middle[std::size_t(axis)] = on;
                    const Vec<T, D> none = Vec<T, D>::zero();
                    columns.try_emplace(middle, NodeColumn<T, D>{none, none, none, T(0), T(0), T(0)});
                }
                for (auto& [index, column] : columns) {
                    Vec<T, D>* const velocities[] = {&column.behind, &column.on, &column.front};
                    T* const of_masses[] = {&column.mass_behind, &column.mass_on, &column.mass_front};
                    for_sides(index, [&](int side, const Sum& sum, const T& mass) {
                        *velocities[side + 1] = sum.*velocity, *of_masses[side + 1] = mass;
                    });
                    column = mirrored(column, axis, inward, contact, with_friction ? friction : T(0),
                                      surface_weights<Kernel, T>());
                    for_sides(index, [&](int side, Sum& sum, T& mass) {
                        sum.*velocity = *velocities[side + 1], mass = *of_masses[side + 1];
                    });
                }
            });
        }
    }
    std::array<int, std::size_t(D)> wrapped_index(std::array<int, std::size_t(D)> index) const {
        for (int a = 0; a < D; ++a)
            if (const int n = domain_.cells(a); domain_.periodic[std::size_t(a)])
                index[std::size_t(a)] = (index[std::size_t(a)] % n + n) % n;
        return index;
    }
    template <class F>
    void for_nodes(const Vec<T, D>& x, const F& f) const {
        by_definition::for_nodes<Kernel>(domain_, x, [&](const Node& node) { f(node, wrapped_index(node.index)); });
    }

    Domain<D> domain_;
    Boundary boundary_;
    std::vector<double> boundary_along_;
    Lifted material_;
    with_scalar_t<Transfer, T> transfer_;
    Vec<T, D> gravity_;
    std::vector<Particle> particles_;
    MeasuredReaction<T, D> reaction_;
    std::size_t flows_ = 0;
    double time_ = 0;  // [s]
};

/// How far a gradient is from the tangent run of the same steps, along a direction.
struct Compared {
    double gradient;  ///< the gradient times the direction
    double tangent;   ///< the derivative of the tangent run
    double terms;     ///< Σ |u_i (J v)_i|, where u are the weights of what is measured and v is the direction
    double value, value_of_tangent;  ///< what is measured, by the simulation and by the tangent run
    double flowing;                  ///< share of the particles that flow in the first step
};

/// Calls add(number) for each number of a particle that is measured, in an order of its own: position, velocity and
/// state.
template <class Particle, class Add>
void for_measured(const Particle& p, const Add& add) {
    for (const auto& x : p.position.v) add(x);
    for (const auto& v : p.velocity.v) add(v);
    std::apply(
        [&](const auto&... field) {
            const auto one = [&](const auto& member) {
                for (const auto& x : firn::detail::Stored<std::remove_cvref_t<decltype(member)>>::numbers(member))
                    add(x);
            };
            (one(p.state.*field.member), ...);
        },
        std::remove_cvref_t<decltype(p.state)>::fields());
}
/// The weight of number k of a particle among what is measured, between −½ and ½.
inline double weight(std::uint32_t id, int k) {
    const double x = std::sin(12.9898 * double(id % 1009) + 78.233 * k) * 43758.5453;
    return x - std::floor(x) - 0.5;
}
/// What is measured: the weighted sum of a particle's numbers.
inline constexpr auto weighted = [](const auto& p) {
    using Number = std::remove_cvref_t<decltype(p.mass)>;
    Number sum = Number(0);
    int k = 0;
    for_measured(p, [&](const Number& x) { sum = sum + Number(weight(p.id, k++)) * x; });
    return sum;
};

/// Fills a direction at random, each kind of number in its usual size. \param like  the simulation at the start
template <class Simulation>
void fill(Gradient<Simulation>& direction, const Simulation& like, test_support::Random& random) {
    const auto& particles = like.particles();
    auto& set = direction.set();
    const double h = like.domain().cell_size;
    const auto fill_all = [&](auto& numbers, double size) {
        for (double& number : numbers) number = random.uniform(-size, size);
    };
    for (const std::uint32_t slot : slots_by_id(particles, 1)) {
        const std::uint32_t id = particles.id(slot);
        fill_all(set.position[id].v, h / 2);
        fill_all(set.velocity[id].v, 1);
        if (decltype(like.transfer)::affine) fill_all(set.affine[id].m, 10);
        set.mass[id] = random.uniform(-1, 1) * particles.mass(slot);
        set.volume[id] = random.uniform(-1, 1) * particles.volume(slot);
        firn::detail::for_state(set.state[id], [&](double& number) { number = random.uniform(-0.1, 0.1); });
    }
    const auto relative = [&](auto& policy, const auto& from, double size) {
        const std::vector<double> numbers = firn::detail::numbers_of(from);
        std::size_t k = 0;
        firn::detail::for_reals(policy, [&](auto& number) {
            number = random.uniform(-1, 1) * (size > 0 ? size : numbers[k]);
            ++k;
        });
    };
    relative(set.material, like.template set<0>().material(), 0);
    for (auto& interval : direction.intervals) {
        fill_all(interval.gravity.v, 10);
        relative(interval.boundary, like.boundary, 0.1);
        relative(interval.transfer, like.transfer, 0);
        for (auto& load : interval.loads)
            for (auto& parameter : load.parameters) parameter.second = random.uniform(-1, 1);
    }
}

/// Takes steps of a simulation through an Adjoint, and compares its gradient with tangent runs in random directions.
/// The size of a step must be a power of two, so that the steps end at their time.
/// \param load  the only load of the simulation, on all particles, if it has one
template <class Simulation, class Load = std::nullptr_t>
std::vector<Compared> compare(Simulation simulation, int steps, int directions, const Load& load = {}) {
    Simulation start = simulation;
    Adjoint adjoint(simulation);
    adjoint.advance(steps * simulation.fixed_time_step);
    if (adjoint.steps() != std::size_t(steps)) throw std::logic_error("The step is no power of two.");
    const double value = adjoint.measure(weighted);
    const auto gradient = adjoint.gradient();
    std::vector<Compared> all;
    test_support::Random random(17);
    for (int d = 0; d < directions; ++d) {
        auto direction = gradient.zero();
        fill(direction, start, random);
        Run<Simulation> run(start, direction);
        double flowing = 0;
        if constexpr (!std::same_as<Load, std::nullptr_t>) {
            std::vector<double> along;
            for (const auto& parameter : direction.intervals[0].loads.at(0).parameters)
                along.push_back(parameter.second);
            auto lifted = lift<T>(load);
            set_derivatives(lifted, along);
            run.load = lifted;
        }
        for (int k = 0; k < steps; ++k) {
            run.step(simulation.fixed_time_step);
            if (k == 0) flowing = double(run.flows()) / double(start.particles().size());
        }
        const T sum = run.measure(weighted);
        const T terms = run.measure([](const auto& p) {
            T total = T(0);
            int k = 0;
            for_measured(p, [&](const T& x) { total.derivative += std::abs(weight(p.id, k++) * x.derivative); });
            return total;
        });
        all.push_back({gradient.along(direction), sum.derivative, terms.derivative, value, sum.value, flowing});
    }
    return all;
}

}  // namespace tangent
