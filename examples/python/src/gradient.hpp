/// \file Derivatives of a whole run of a simulation that was chosen at run time.
#pragma once

#include <firn/any_simulation.hpp>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace python {

/// The materials through which the module goes back; each takes some seconds to compile in each dimension.
using WithDerivatives = firn::OfferedMaterials<firn::FixedCorotated, firn::NeoHookean, firn::Fluid>;

/// The derivatives by a field of the particles: of each particle, in the order of ids, as many numbers as the field
/// has.
struct ByField {
    std::string name;
    int components;
    std::vector<double> numbers;
};

/// The derivatives of a number by what a run began with.
struct ByStart {
    std::vector<ByField> fields;
    std::vector<firn::StateParameter> material;  ///< by the parameters of the material
    std::vector<double> gravity;
    std::vector<std::string> boundary;  ///< of each part of the choice, as a text of the kind that describes the part
};

/// A copy of a simulation, for a run and back.
class RunAndBack {
public:
    virtual ~RunAndBack() = default;
    /// Takes steps until `duration` [s] has passed, and goes back. To be called once.
    /// \param by_position, by_velocity  the derivatives by the positions [per m] and velocities [per m/s] at the end, of
    ///                                  one particle after the other in the order of ids; if they are empty, all are 0
    virtual ByStart back(double duration, std::span<const double> by_position, std::span<const double> by_velocity) = 0;
};

/// Returns a copy of a simulation for a run and back. Its steps are those of the simulation up to rounding: it has
/// other types, and compilers may join products and sums elsewhere.
/// \param memory  for checkpoints [bytes]. \see firn::AdjointOptions
/// \throws firn::parameter_error  if the simulation is one without derivatives: the message says what has them; or if
///                                the memory is too small
template <int D>
std::unique_ptr<RunAndBack> run_and_back(const firn::AnySimulation<D>& simulation, std::size_t memory);

}  // namespace python
