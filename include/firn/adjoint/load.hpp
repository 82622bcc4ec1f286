/// \file Loads that have a way back, and what an Adjoint does with them.
#pragma once

#include <firn/adjoint/gradient.hpp>
#include <firn/adjoint/inputs.hpp>
#include <firn/simulation/load.hpp>
#include <firn/simulation/set_of.hpp>

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A particle on which a load acts, for the way back of the load.
template <int D>
struct LoadedParticle {
    std::size_t slot;
    double mass;                 ///< mass [kg]
    Vec<double, D> position,     ///< position [m]
        of_force,                ///< the adjoint of the force on the particle [per N]
        force{}, of_position{};  ///< Computed by the way back: the force [N], and the adjoint of the position [per m].
};

/// The function of a load, with its derivatives, whatever its type.
template <int D>
class LoadFunction {
public:
    virtual ~LoadFunction() = default;
    /// Returns the force [N] on a particle. \param time  [s]
    virtual Vec<double, D> force(const Vec<double, D>& position, double time) const = 0;
    /// Returns the names of the parameters, of each number one.
    virtual std::vector<std::string> names() const = 0;
    /// Returns the function with other parameters: each is changed by t times its `by`.
    virtual std::shared_ptr<const LoadFunction> shifted(std::span<const NamedDerivative> by, double t) const = 0;
    /// Computes the forces on particles and the adjoints of their positions, and adds to the derivatives by the
    /// parameters.
    virtual void back(double time, std::span<LoadedParticle<D>> particles, std::span<double> of_parameters) const = 0;
};

/// Returns a force in numbers of type T.
template <class T, int D, class F>
Vec<T, D> force_of(const F& f, const Vec<T, D>& position, double time) {
    const auto given = f(position, time);  // its numbers may be constants, of type double
    Vec<T, D> force;
    for (int a = 0; a < D; ++a) force[a] = T(given[a]);
    return force;
}

/// The function of a load, of type F: a policy of doubles, or a function object without a scalar.
template <int D, class F>
class LoadFunctionOf final : public LoadFunction<D> {
    using T = traced<double>;

public:
    explicit LoadFunctionOf(const F& f) : f_(f) {}
    Vec<double, D> force(const Vec<double, D>& position, double time) const override {
        return force_of(f_, position, time);
    }
    std::vector<std::string> names() const override { return names_of(f_); }
    std::shared_ptr<const LoadFunction<D>> shifted(std::span<const NamedDerivative> by, double t) const override {
        F other(f_);
        std::size_t next = 0;
        for_numbers<double>(other, [&](double& number) { number += t * by[next++].second; });
        return std::make_shared<LoadFunctionOf>(other);
    }
    void back(double time, std::span<LoadedParticle<D>> particles, std::span<double> of_parameters) const override {
        Tape<double>& tape = Tape<double>::mine();
        tape.cut(1);
        using Lifted = decltype(lift<T>(f_));
        const TracedPolicy<double, Lifted> lifted(lift<T>(f_));
        const std::size_t start = tape.size();
        for (LoadedParticle<D>& particle : particles) {
            tape.cut(start);
            const Vec<T, D> position = inputs(particle.position), force = force_of(*lifted, position, time);
            tape.begin();
            seed(force, particle.of_force);
            tape.back();
            lifted.add_to(of_parameters);
            for (int a = 0; a < D; ++a) particle.force[a] = force[a].value;
            particle.of_position = adjoint_of(position);
        }
    }

private:
    F f_;
};

template <class F, int D, class T>
concept is_load_of = requires(const F& f, const Vec<T, D>& position) { T(f(position, 0.0)[0]); };

}  // namespace detail

/// The force of a load that has derivatives. differentiable_load() makes it.
template <int D>
class DifferentiableLoad {
public:
    /// Makes it from a function. \see differentiable_load
    template <class F>
        requires(!std::same_as<F, DifferentiableLoad>)
    explicit DifferentiableLoad(const F& f) {
        using Policy = decltype(lift<double>(f));
        using Lifted = decltype(lift<traced<double>>(f));
        constexpr bool is_template =
            detail::is_load_of<Policy, D, double> && detail::is_load_of<Lifted, D, traced<double>>;
        static_assert(is_template,
                      "firn: a differentiable load is a function of a position [m], in any scalar, and the time [s] "
                      "that returns a force [N] in this scalar: [](const auto& x, double time) { … }, or a policy "
                      "that is a template over the scalar.");
        static_assert(!has_parameters<F> || !std::same_as<Policy, Lifted>,
                      "firn: this load has parameters(), but is not a template over the scalar, so it has no "
                      "derivatives by them: template <class T> struct …");
        if constexpr (is_template) function_ = std::make_shared<detail::LoadFunctionOf<D, Policy>>(lift<double>(f));
    }

    /// Returns the force [N] on a particle at a position [m], at a time [s].
    Vec<double, D> operator()(const Vec<double, D>& position, double time) const {
        return function_->force(position, time);
    }
    /// Returns the load with other parameters: each is changed by t times its entry of `by`. \see LoadGradient
    DifferentiableLoad shifted(std::span<const NamedDerivative> by, double t) const {
        DifferentiableLoad other = *this;
        other.function_ = function_->shifted(by, t);
        return other;
    }
    /// Returns the function, for the way back.
    const detail::LoadFunction<D>& function() const { return *function_; }

private:
    std::shared_ptr<const detail::LoadFunction<D>> function_;
};

namespace detail {
/// A function that becomes the force of a load in any dimension D.
template <class F>
class DifferentiableForce {
public:
    explicit DifferentiableForce(const F& f) : f_(f) {}
    template <int D>
    operator std::function<Vec<double, D>(const Vec<double, D>&, double)>() const {
        return DifferentiableLoad<D>(f_);
    }

private:
    F f_;
};
}  // namespace detail

/// Makes a force for add_load() through which an Adjoint goes back:
///
///     simulation.add_load(body, firn::differentiable_load([](const auto& x, double time) { return x * -30.0; }));
///
/// \param f  f(position [m], time [s]) returns the force on one particle [N]. It takes a Vec<T, D> of any scalar T, and
///           returns a Vec of this scalar, or of double if it does not depend on the position. If it is a policy with
///           parameters(), there are derivatives by its parameters, too: it is then a template over the scalar. What a
///           lambda captures has no derivative.
/// \see LoadGradient
template <class F>
detail::DifferentiableForce<F> differentiable_load(const F& f) {
    return detail::DifferentiableForce<F>(f);
}

namespace detail {

/// Refuses loads that have no way back. \throws usage_error  if there is one
template <std::floating_point S, int D>
void refuse_loads_of_doubles(const SetList<S, D>& sets) {
    for (std::uint32_t k = 0; k < sets.size(); ++k)
        if (const Loads<S, D>* const loads = loads_of(sets[k].loads))
            for (std::size_t i = 0; i < loads->all().size(); ++i)
                if (!loads->all()[i].force.template target<DifferentiableLoad<D>>())
                    throw usage_error(
                        sentence("Load ", loads->number(i), " of material ", k,
                                 " is a function of doubles, so there are no derivatives through it. Add it as "
                                 "firn::differentiable_load(f), of a function f that is a template over the scalar."));
}

/// The loads of all sets in an interval, and the derivatives by their parameters.
template <std::floating_point S, int D>
class RecordedLoads {
public:
    RecordedLoads() = default;
    /// Records the loads of these sets. All must be differentiable.
    explicit RecordedLoads(const SetList<S, D>& sets) {
        for (std::uint32_t k = 0; k < sets.size(); ++k) {
            of_sets_.push_back(sets[k].loads);
            for_loads(of_sets_.back(), [&](const Load<D>&, const DifferentiableLoad<D>& force, std::uint32_t number) {
                LoadGradient& of = derivatives_.emplace_back();
                of.load = {k, number};
                for (const std::string& name : force.function().names()) of.parameters.emplace_back(name, 0.0);
            });
        }
    }

    /// Gives the sets these loads, in place of their own.
    void give_to(SetList<S, D>& sets) const {
        for (std::size_t k = 0; k < sets.size(); ++k) sets[k].loads = of_sets_[k];
    }
    /// Gives the sets these loads, with parameters that are changed by t times `by`.
    void give_to(SetList<S, D>& sets, const std::vector<LoadGradient>& by, double t) const {
        give_to(sets);
        std::size_t next = 0;
        for (SetOf<S, D>& set : sets)
            for_loads(set.loads, [&](Load<D>& load, const DifferentiableLoad<D>& force, std::uint32_t) {
                load.force = force.shifted(by.at(next++).parameters, t);
            });
    }

    /// Sets all derivatives to 0.
    void forget() {
        for (LoadGradient& of : derivatives_)
            for (NamedDerivative& parameter : of.parameters) parameter.second = 0;
    }
    /// Returns the derivatives by the parameters of each load.
    const std::vector<LoadGradient>& derivatives() const { return derivatives_; }

    /// The way back of the loads of set k in a step of dt [s] from `time` [s], v += f(x, time) dt/m: adds to the
    /// adjoints of positions and masses, and to the derivatives by the parameters. The adjoints of velocities stay.
    /// \param bar  the adjoints of the particles
    template <class Bar>
    void back(std::size_t k, const ParticleStore<S, D>& particles, const Bar& bar, double time, double dt,
              int threads) {
        for_loads(of_sets_[k], [&](const Load<D>& load, const DifferentiableLoad<D>& force, std::uint32_t number) {
            const LoadId id{std::uint32_t(k), number};
            auto& parameters = std::ranges::find(derivatives_, id, &LoadGradient::load)->parameters;
            OrderedSums sums((particles.slots() + at_once - 1) / at_once, parameters.size());
            for_chunks(particles.slots(), threads, [&](std::size_t first, std::size_t last) {
                back(particles, load.body, force.function(), bar, time, dt, first, last, sums.of(first / at_once));
            });
            std::vector<double> total(parameters.size());
            sums.add_to(total);
            for (std::size_t i = 0; i < total.size(); ++i) parameters[i].second += total[i];
        });
    }

private:
    /// The way back of a load on the particles in the slots from `first` to before `last`.
    template <class Bar>
    static void back(const ParticleStore<S, D>& particles, const Body& body, const LoadFunction<D>& function,
                     const Bar& bar, double time, double dt, std::size_t first, std::size_t last,
                     std::span<double> of_parameters) {
        std::vector<LoadedParticle<D>> all;
        for (std::size_t slot = first; slot < last; ++slot) {
            if (!particles.is_particle(slot) || !body.holds(particles.id(slot))) continue;
            const double mass = double(particles.mass(slot));
            Vec<double, D> of_force;
            for (int a = 0; a < D; ++a) of_force[a] = double(*bar.velocity.at(slot, a)) * (dt / mass);
            all.push_back({slot, mass, particles.exact_position(slot), of_force});
        }
        if (all.empty()) return;
        function.back(time, all, of_parameters);
        const double h = particles.domain().cell_size;
        for (const LoadedParticle<D>& particle : all) {
            for (int a = 0; a < D; ++a) *bar.position.at(particle.slot, a) += S(particle.of_position[a] * h);
            *bar.mass.at(particle.slot, 0) -= S(dot(particle.of_force, particle.force) / particle.mass);
        }
    }
    /// Calls f(load, force, number) for each load of a set.
    template <class F>
    static void for_loads(const MaybePush<S, D>& of_set, const F& f) {
        if (Loads<S, D>* const loads = loads_of(of_set))
            for (std::size_t i = 0; i < loads->all().size(); ++i) {
                Load<D>& load = loads->all()[i];
                f(load, *load.force.template target<DifferentiableLoad<D>>(), loads->number(i));
            }
    }

    std::vector<MaybePush<S, D>> of_sets_;
    std::vector<LoadGradient> derivatives_;
};

/// The velocities of particles before loads push them, of the sets that have loads.
template <std::floating_point S, int D>
class VelocitiesBeforePush {
public:
    /// Keeps the velocities.
    void keep(SetList<S, D>& sets, int threads) {
        of_sets_.resize(sets.size());
        for (std::size_t k = 0; k < sets.size(); ++k) {
            of_sets_[k].resize(sets[k].loads ? sets[k].partition.slots() * std::size_t(D) : 0);
            copy(numbers(sets[k]), of_sets_[k].data(), of_sets_[k].size(), threads);
        }
    }
    /// Gives the particles the velocities back.
    void give_back(SetList<S, D>& sets, int threads) const {
        for (std::size_t k = 0; k < sets.size(); ++k)
            copy(of_sets_[k].data(), numbers(sets[k]), of_sets_[k].size(), threads);
    }

private:
    static S* numbers(SetOf<S, D>& set) { return set.store().motion().velocity.at(0, 0); }
    static void copy(const S* from, S* to, std::size_t count, int threads) {
        if (count > 0) copy_and_fill(from, count, to, count, S(0), threads);
    }

    std::vector<aligned_vector<S>> of_sets_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
