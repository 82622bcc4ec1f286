/// \file What a simulation that is chosen at run time can do, whatever its types.
#pragma once

#include <firn/any/choice.hpp>
#include <firn/data/samples.hpp>
#include <firn/io/state.hpp>
#include <firn/io/state_parts.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/loops/totals.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/run_of.hpp>
#include <firn/simulation/source.hpp>

#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A state in the precision of the run.
using AnyState = std::variant<State<float>, State<double>>;

namespace detail {

/// The particles of a set, in the precision of the run.
template <int D>
using AnyStore = std::variant<ParticleStore<float, D>*, ParticleStore<double, D>*>;

/// The functions of AnySimulation that need the types of the simulation. Sets are numbered in the order of the choice.
template <int D>
class AnyRun {
public:
    virtual ~AnyRun() = default;
    virtual std::unique_ptr<AnyRun> copy() const = 0;
    virtual Stepper<D>& stepper() = 0;                                    ///< Returns time, gravity and warnings.
    virtual std::variant<RunOf<float, D>*, RunOf<double, D>*> run() = 0;  ///< Returns the run, in its precision.
    virtual std::size_t index_of(std::size_t k) const = 0;  ///< Returns the index of set k among the run's sets.
    virtual void step() = 0;
    virtual void advance(double duration) = 0;
    virtual double stable_time_step() = 0;
    virtual Body add(std::size_t k, const Samples<D>& samples, double density, const Vec<double, D>& velocity) = 0;
    virtual void add_source(std::size_t k, const Source<D>& source) = 0;
    virtual void add_sink(std::size_t k, const Sink<D>& sink) = 0;
    virtual std::size_t remove_if(std::size_t k,
                                  const std::function<bool(const Vec<double, D>&, std::uint32_t)>& wanted) = 0;
    virtual const std::vector<Body>& bodies(std::size_t k) const = 0;
    virtual Totals<D> totals(std::size_t k) const = 0;
    virtual AnyStore<D> edit_particles(std::size_t k) = 0;  ///< \see SetAccess::edit_particles
    virtual void edit_material(std::size_t k, const std::vector<NamedNumber>& parameters) = 0;
    virtual std::vector<StateParameter> material(std::size_t k) const = 0;
    virtual BoundaryPart<D> part(BoundaryPart<D> given, const PlaceOfPart& place) const = 0;
    virtual void set_part(const BoundaryPart<D>& part, const PlaceOfPart& place) = 0;
    virtual Reaction<D> reaction(const PlaceOfPart& place) const = 0;
    virtual AnyState state(std::size_t k) = 0;
    virtual void restore(std::size_t k, const AnyState& state, Restart how) = 0;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
