//! # On a GPU
//!
//! firn writes a complete WGSL program from the same policies, without a change of their code. Your own material works,
//! too. To write the program, firn calls the policies with a scalar that records its operations. So no formula is
//! written twice.
#include <firn/boundary/walls.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/wgsl/program.hpp>

#include "../own_material.hpp"

#include <fstream>
#include <iostream>

int main() {
    const SoftTissue<float> tissue{.mu = 2e4F, .lambda = 3e4F};
    const auto walls = firn::Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::separate, 0});
    const auto program = firn::wgsl::make_program<firn::QuadraticBSpline, firn::Apic, firn::MlsForce, 3>(tissue, walls);

    //! `program.code` is WGSL. The manifest is JSON. It lists what a host needs to know: uniforms with their units and
    //! offsets, buffers, entry points, and the order in which a step calls the entry points.
    std::ofstream("program.wgsl") << program.code;
    std::ofstream("manifest.json") << firn::wgsl::manifest(program);
    std::cout << program.name << ": " << program.code.size() << " bytes of WGSL\n";

    //! ## Run it
    //!
    //! `examples/web/firn.mjs` runs programs in a browser, in node or in Deno. `examples/web/run.sh` serves a web page
    //! that runs scenes.
    //!
    //! In C++, firn::webgpu runs programs through any library with WebGPU's C interface (Dawn, wgpu-native):
    //!
    //! ```cpp
    //! #include <firn/webgpu/host.hpp>
    //!
    //! const firn::webgpu::Device device;
    //! firn::webgpu::Host host(
    //!     device, program, firn::wgsl::make_inputs<3>(program, domain, cpu.particles(), 1e-4, device.limits()));
    //! simulation.initialise();
    //! simulation.step(100);
    //! simulation.check();                                 // throws if a particle has left the domain, …
    //! const auto velocity = simulation.read("velocity");  // m/s, three numbers for each particle
    //! ```
    //!
    //! ## What to know
    //!
    //! - P2G adds integers with atomics. So the sums do not depend on their order: they have the same bits as on the
    //!   CPU (firn::FixedPoint). The scale of the integers comes from a bound, so that no sum overflows.
    //! - If an integer would overflow, or a particle leaves the domain, the program stops with an error in the buffer
    //!   `status`.
    //! - WebGPU's default limits (eight storage buffers a stage, 128 MiB a buffer) allow 3.7 million particles in 3D
    //!   and a grid of up to 200³ nodes. With a device of higher limits, both may be larger.
    //! - Programs support one material, PIC and APIC, float and a dense grid. They do not support periodic axes, or
    //!   meshes as boundaries.
    //! - Mirrored walls must lie on planes of nodes also where a host moves them; a step reports an error otherwise.
    //! - For FBar or VolumeFilter, give the acceleration field and the policy: `make_program<…>(tissue, walls, gravity,
    //!   firn::FBar{})`. The parameters of VolumeFilter become fixed parts of the program. It counts its steps from 0.
    //!   Where VolumeFilter shifts particles, and the host moves walls, it sets room_lower and room_upper anew.
    //!
    //! `06_emit_wgsl --list` lists the programs that it writes: every kernel, transfer and force form with one material,
    //! every material with one of these, and snow with an obstacle. `--all FOLDER` writes them. firn::wgsl makes a
    //! program of any other combination.
    //!
    //! If the uniform `bound_time_step` is 1, no step is longer than the stable time step, as on the CPU.
    //! `simulation.advance(duration)` takes such steps until the time has passed, on the GPU alone. They are those of the
    //! CPU, to the bit, with `firn::FixedPoint<>{.float_steps = true}`.
    //!
    //! ![A snowball breaks on a wall in the browser: examples/web](../images/web.png)
    return program.code.size() > 1000 ? 0 : 1;
}
