//! # On a GPU
//!
//! The same policies write a complete WGSL program, a material of yours included, without a line changed. A definition
//! is evaluated with a scalar that records what it computes; no formula stands twice.
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

    //! `program.code` is WGSL. The manifest says in JSON what a host needs: uniforms with their units and offsets,
    //! buffers, entry points, and the order in which a step calls them.
    std::ofstream("program.wgsl") << program.code;
    std::ofstream("manifest.json") << firn::wgsl::manifest(program);
    std::cout << program.name << ": " << program.code.size() << " bytes of WGSL\n";

    //! ## Run it
    //!
    //! In a browser, in node or in Deno: `examples/web/firn.mjs`. The page `examples/web/run.sh` serves runs scenes.
    //!
    //! From C++, firn::webgpu runs programs through any library with WebGPU's C interface (Dawn, wgpu-native):
    //!
    //! ```cpp
    //! #include <firn/webgpu/host.hpp>
    //!
    //! const firn::webgpu::Device device;
    //! firn::webgpu::Simulation simulation(
    //!     device, program, firn::wgsl::make_inputs<3>(program, domain, cpu.particles(), 1e-4, device.limits()));
    //! simulation.initialise();
    //! simulation.step(100);
    //! simulation.check();                                 // throws if a particle has left the domain, …
    //! const auto velocity = simulation.read("velocity");  // m/s, three numbers for each particle
    //! ```
    //!
    //! ## What to know
    //!
    //! - P2G adds integers with atomics, so sums do not depend on their order: they are the CPU's to the bit
    //!   (firn::FixedPoint). The scale comes from a bound that is proven not to overflow.
    //! - What would wrap or leave the domain stops the program with an error in the buffer `status`.
    //! - WebGPU's default limits (eight storage buffers a stage, 128 MiB a buffer) allow 3.7 million particles in 3D
    //! and
    //!   a grid of up to 200³ nodes. A device that allows more takes more.
    //! - Programs know one material, PIC and APIC, float, a dense grid; no periodic axes and no meshes as boundaries.
    //!
    //! `06_emit_wgsl --list` names every combination that can be written; `--all FOLDER` writes them.
    //!
    //! ![Two elastic cubes in the browser: examples/web](../images/web.png)
    return program.code.size() > 1000 ? 0 : 1;
}
