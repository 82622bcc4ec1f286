/// \file What steps of a Simulation on a GPU cannot do, and the sentences that say so.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>
#include <firn/webgpu/set_on_device.hpp>
#include <firn/wgsl/manifest.hpp>

#include <algorithm>
#include <string>
#include <string_view>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Throws if a simulation has something that steps on a GPU do not do.
/// \param can_be_sparse     whether its programs can have a sparse grid. \see wgsl::can_be_sparse
/// \throws usage_error      if so, with a sentence that names it
/// \throws parameter_error  if the CPU would choose steps or add loads in double
template <int D, class Simulation>
void check_for_gpu(Simulation& simulation, bool can_be_sparse) {
    const auto refuse = [](const std::string& what) {
        throw usage_error("A GPU cannot do " + what + ": take the steps on the CPU.");
    };
    for (const auto& pass : simulation.passes()) {
        constexpr std::string_view on_cpu[] = {"restore masses", "end g2p", "sinks and sources"};
        const auto is_it = [&](std::string_view name) { return name == pass.name; };
        if (std::ranges::none_of(wgsl::passes_of_programs, is_it) && std::ranges::none_of(on_cpu, is_it))
            refuse("the pass '" + pass.name + "' of this simulation");
    }
    if (is_periodic(simulation.domain()) && !can_be_sparse) refuse("particle shifting in a periodic domain");
    bool has_loads = false;
    for (const auto& set : simulation.sets()) {
        if (set.forces) refuse("forces between particles");
        for (const Load<D>& load : list_of_loads(set.loads)) {
            has_loads = true;
            if (!load.force.template target<UniformForce<D>>())
                refuse("loads that may depend on the position (give a UniformForce)");
        }
    }
    if ((has_loads || !(simulation.fixed_time_step > 0)) && !simulation.execution.float_steps)
        throw parameter_error(
            "A GPU chooses time steps in float, and adds loads in float: set execution.float_steps, so that the "
            "CPU does so, too; or, without loads, fixed_time_step.");
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
