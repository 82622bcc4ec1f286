/// \file How long each entry point of a step takes on a GPU, by its own clock.
///
///     webgpu::Device device({.timestamps = true});
///     auto gpu = webgpu::on_gpu(simulation, device);
///     for (const webgpu::PassTime& pass : webgpu::time_passes(gpu, 100))
///         std::cout << pass.entry_point << ": " << 1e3 * pass.mean << " ms\n";
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/webgpu/host.hpp>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu {

template <class Simulation>
class OnGpu;  // in on_gpu.hpp

/// What one entry point of a step took.
struct PassTime {
    std::string entry_point;      ///< name of the entry point
    std::string material;         ///< name of the material of its particles
    double median = 0,            ///< median of its times, one of each step [s]
        mean = 0;                 ///< their mean [s]
    std::uint32_t particles = 0;  ///< number of particles that the program has
    /// Size of what the entry point may read and write of a particle [bytes], if it runs for each particle, else 0: all
    /// numbers in the buffers of particles that it has access to, twice if it may write them. It may touch fewer, and
    /// what it touches of the nodes is not counted.
    int bytes_a_particle = 0;
};

/// Runs steps on a device and takes the time of each entry point. Each of them is a compute pass of its own, between
/// two timestamps of the device; Host::run() has all steps in one pass. The bits of particles are the same.
///
/// Dawn is told not to round timestamps. A library that rounds them, as web browsers do to 0.1 ms, makes the medians
/// useless; the mean of many steps is still right.
class PassTimer {
public:
    /// Runs a sequence of entry points as Host::run() does, and waits for them. If the sequence is another one than
    /// that of the last call, all times before are forgotten.
    /// \throws usage_error  if the device has no timestamps, if one of the names is not the name of an entry point of
    ///                      its Host's program, or if the sequence has more than 2048 entry points
    /// \throws device_error  if the device was lost, or if it has refused a command
    void run(const Host::Sequence& step, int times = 1) {
        if (step.empty()) return;
        const Device& device = step.front().first->device_;
        require_timestamps(device);
        constexpr std::size_t most_queries = 4096;  // which every device allows
        const std::size_t queries = 2 * step.size();
        if (queries > most_queries)
            throw usage_error(sentence("The times of ", step.size(), " entry points were asked for; at most ",
                                       most_queries / 2, " can be taken."));
        take_names(step);
        const int at_once = std::min<int>(Host::in_one_submission, int(most_queries / queries));
        const auto count = std::uint32_t(queries) * std::uint32_t(at_once);
        const auto [set, wrong] = detail::make_timestamps(device, count);
        if (!set) throw device_error("The device gives no timestamps: " + wrong);
        const detail::OwnedBuffer ticks = detail::make_buffer(device, "timestamps", count * sizeof(std::uint64_t),
                                                              WGPUBufferUsage_QueryResolve | WGPUBufferUsage_CopySrc);
        for (int done = 0; done < times; done += at_once)
            run_some(device, step, std::min(at_once, times - done), set, ticks);
    }

    /// Returns the times of all steps so far, of each entry point in the order of the sequence.
    std::vector<PassTime> times() const {
        std::vector<PassTime> all = passes_;
        for (std::size_t k = 0; k < all.size(); ++k) {
            std::vector<double> sorted = seconds_[k];
            if (sorted.empty()) continue;
            std::ranges::sort(sorted);
            const std::size_t middle = sorted.size() / 2;
            all[k].median = sorted.size() % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
            for (const double one : sorted) all[k].mean += one / double(sorted.size());
        }
        return all;
    }

    /// \throws usage_error  if the device has no timestamps
    static void require_timestamps(const Device& device) {
        if (!device.has_timestamps())
            throw usage_error("There are no timestamps of the GPU " + device.name() +
                              ": make the Device with DeviceOptions::timestamps. If Device::has_timestamps() is false "
                              "then, too, the GPU has none.");
    }

private:
    /// Runs so many steps that the set of queries has room for, and keeps the times.
    void run_some(const Device& device, const Host::Sequence& step, int steps, const detail::OwnedQueries& set,
                  const detail::OwnedBuffer& ticks) {
        const std::vector<const detail::Kernel*> kernels = Host::kernels_of(step);
        const detail::OwnedEncoder encoder(wgpuDeviceCreateCommandEncoder(device.handle(), nullptr));
        std::uint32_t query = 0;
        for (int i = 0; i < steps; ++i)
            for (const detail::Kernel* kernel : kernels) {
                WGPUPassTimestampWrites times{};
                times.querySet = set.get();
                times.beginningOfPassWriteIndex = query++;
                times.endOfPassWriteIndex = query++;
                WGPUComputePassDescriptor asked{};
                asked.timestampWrites = &times;
                const detail::OwnedPass pass(wgpuCommandEncoderBeginComputePass(encoder.get(), &asked));
                kernel->dispatch(pass);
                wgpuComputePassEncoderEnd(pass.get());
            }
        wgpuCommandEncoderResolveQuerySet(encoder.get(), set.get(), 0, query, ticks.get(), 0);
        detail::submit(device, encoder);
        const std::vector<std::uint64_t> of_device = detail::download<std::uint64_t>(device, ticks.get(), 0, query);
        constexpr double nanosecond = 1e-9;
        for (std::size_t q = 0; q < query; q += 2) {
            const std::uint64_t begin = of_device[q], end = of_device[q + 1];  // a device may set its clock back
            seconds_[q / 2 % kernels.size()].push_back(end > begin ? nanosecond * double(end - begin) : 0);
        }
    }

    void take_names(const Host::Sequence& step) {
        std::vector<PassTime> passes;
        for (const auto& [host, name] : step) {
            const wgsl::Program& program = *host->program_;
            PassTime& pass = passes.emplace_back(PassTime{.entry_point = name, .material = program.material});
            pass.particles = host->particles();
            if (!program.has(name) || program.entry_point(name).per != "particle") continue;
            for (const auto& [binding, written] : program.entry_point(name).bindings)
                for (const wgsl::Buffer& b : program.buffers)
                    if (b.binding == binding && b.per == "particle")
                        pass.bytes_a_particle += (written ? 2 : 1) * b.count * int(sizeof(float));
        }
        const auto same = [](const PassTime& a, const PassTime& b) {
            return a.entry_point == b.entry_point && a.material == b.material && a.particles == b.particles;
        };
        if (std::ranges::equal(passes, passes_, same)) return;
        passes_ = std::move(passes);
        seconds_.assign(passes_.size(), {});
    }

    std::vector<PassTime> passes_;
    std::vector<std::vector<double>> seconds_;  // of each pass, in each step
};

/// Takes `times` steps of a sequence of entry points, of one or several Hosts, and returns the time of each, in the
/// order of the sequence. The numbers of particles have the bits that Host::run() gives. Waits for the steps.
/// \throws usage_error   if the device has no timestamps, see DeviceOptions::timestamps; or as PassTimer::run()
/// \throws device_error  if the device was lost, or if it has refused a command
inline std::vector<PassTime> time_passes(const Host::Sequence& step, int times) {
    PassTimer timer;
    timer.run(step, times);
    return timer.times();
}

/// Takes `steps` steps of a simulation on a GPU as OnGpu::step() does, and returns the time of each entry point of a
/// step, for each set of particles (and each part of a set that is too large for one buffer). Include
/// firn/webgpu/on_gpu.hpp. If the device runs short of memory for blocks of nodes, or a particle meets a sink, steps
/// are begun that do nothing until the CPU has looked: they count, too.
/// \throws usage_error  if the device has no timestamps, see DeviceOptions::timestamps; or if the time step is not
/// fixed
/// \throws parameter_error, usage_error, particle_error, overflow_error, device_error  in the same cases as
///                                                                                     OnGpu::step()
template <class Simulation>
std::vector<PassTime> time_passes(OnGpu<Simulation>& gpu, int steps) {
    PassTimer::require_timestamps(gpu.device());
    PassTimer timer;
    gpu.step_by(std::uint64_t(steps), [&](const Host::Sequence& step, int times) { timer.run(step, times); });
    return timer.times();
}

}  // namespace firn::inline FIRN_BUILD::webgpu
