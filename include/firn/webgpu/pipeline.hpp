/// \file Compiles a WGSL program for a device: makes the shader module, and a pipeline for each entry point.
#pragma once

#include <firn/webgpu/device.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Returns the line of the code with the given line number. The first line has the line number 1.
inline std::string line_of(std::string_view code, std::uint64_t number) {
    for (; number > 1; --number) {
        const std::size_t end = code.find('\n');
        code.remove_prefix(end == std::string_view::npos ? code.size() : end + 1);
    }
    return std::string(code.substr(0, code.find('\n')));
}

/// Compiles a program and returns its shader module.
/// \throws device_error  if the compiler reports errors; for each error, the message has the program's name, the line
///                       number, the text of the line, and the column
inline OwnedModule compile(const Device& device, const wgsl::Program& program) {
    WGPUShaderSourceWGSL source{};
    source.chain.sType = WGPUSType_ShaderSourceWGSL;
    source.code = view(program.code);
    WGPUShaderModuleDescriptor asked{};
    asked.nextInChain = &source.chain;
    asked.label = view(program.name);
    OwnedModule module;
    const auto wrong = objection(device, [&] { module.reset(wgpuDeviceCreateShaderModule(device.handle(), &asked)); });
    std::string messages;
#if !__has_include(<webgpu/wgpu.h>)  // wgpu-native, which has this header, has the messages in `wrong`
    if (module && wrong) {
        struct Reader {
            const wgsl::Program& program;
            std::string& messages;
        } reader{program, messages};
        Answer<WGPUCompilationInfoRequestStatus> answer;
        WGPUCompilationInfoCallbackInfo callback{};
        callback.mode = WGPUCallbackMode_AllowProcessEvents;
        callback.callback = [](WGPUCompilationInfoRequestStatus status, WGPUCompilationInfo const* info, void* to,
                               void* with) {
            const Reader& r = *static_cast<Reader*>(with);
            for (std::size_t i = 0; info && i < info->messageCount; ++i) {
                const WGPUCompilationMessage& m = info->messages[i];
                if (m.type == WGPUCompilationMessageType_Error)
                    r.messages +=
                        sentence(r.messages.empty() ? "" : "\n", r.program.name, ".wgsl:", m.lineNum, ":", m.linePos,
                                 ": ", text(m.message), "\n    ", line_of(r.program.code, m.lineNum));
            }
            static_cast<Answer<WGPUCompilationInfoRequestStatus>*>(to)->give(status, {});
        };
        callback.userdata1 = &answer;
        callback.userdata2 = &reader;
        wgpuShaderModuleGetCompilationInfo(module.get(), callback);
        answer.wait(device.instance());
    }
#endif
    if (!messages.empty()) throw device_error(messages);
    if (wrong || !module) throw device_error(program.name + ".wgsl: " + wrong.value_or("cannot be compiled"));
    return module;
}

/// A compiled entry point: its pipeline, and the layout of its buffers.
struct Pipeline {
    OwnedLayout layout;
    OwnedPipeline pipeline;
};
/// A compiled program.
struct Compiled {
    std::map<std::string, Pipeline> pipelines;  // the key is the entry point's name
};

/// An entry point that is ready to be dispatched (started on the GPU): its pipeline, its buffers (the bind group) and
/// the number of workgroups.
struct Kernel {
    WGPUComputePipeline pipeline;
    OwnedBindGroup bind_group;
    wgsl::Dispatch groups;

    void dispatch(const OwnedPass& pass) const {
        wgpuComputePassEncoderSetPipeline(pass.get(), pipeline);
        wgpuComputePassEncoderSetBindGroup(pass.get(), 0, bind_group.get(), 0, nullptr);
        wgpuComputePassEncoderDispatchWorkgroups(pass.get(), groups.x, groups.y, 1);
    }
};

using Buffers = std::map<int, OwnedBuffer>;  // the key is the buffer's binding number

[[noreturn, gnu::cold]] inline void throw_of_entry_point(const wgsl::Program& program, const wgsl::EntryPoint& e,
                                                         const std::optional<std::string>& wrong) {
    throw device_error(
        sentence(program.name, ".wgsl: entry point ", e.name, ": ", wrong.value_or("no reason is given")));
}

/// Makes the pipeline of entry point e.
/// \throws device_error  if the device refuses the entry point; the message names it
inline Pipeline make_pipeline(const Device& device, const wgsl::Program& program, const OwnedModule& module,
                              const wgsl::EntryPoint& e) {
    std::vector<WGPUBindGroupLayoutEntry> kinds;
    for (const auto& [binding, written] : e.bindings) {
        WGPUBindGroupLayoutEntry kind{};
        kind.binding = std::uint32_t(binding);
        kind.visibility = WGPUShaderStage_Compute;
        kind.buffer.type = binding == 0 ? WGPUBufferBindingType_Uniform
                           : written    ? WGPUBufferBindingType_Storage
                                        : WGPUBufferBindingType_ReadOnlyStorage;
        kinds.push_back(kind);
    }
    Pipeline made;
    const auto wrong = objection(device, [&] {
        WGPUBindGroupLayoutDescriptor of_layout{};
        of_layout.entryCount = kinds.size();
        of_layout.entries = kinds.data();
        made.layout.reset(wgpuDeviceCreateBindGroupLayout(device.handle(), &of_layout));
        const WGPUBindGroupLayout layouts[] = {made.layout.get()};
        WGPUPipelineLayoutDescriptor of_layouts{};
        of_layouts.bindGroupLayoutCount = std::size(layouts);
        of_layouts.bindGroupLayouts = layouts;
        const OwnedPipelineLayout all(wgpuDeviceCreatePipelineLayout(device.handle(), &of_layouts));
        WGPUComputePipelineDescriptor of_pipeline{};
        of_pipeline.label = view(e.name);
        of_pipeline.layout = all.get();
        of_pipeline.compute.module = module.get();
        of_pipeline.compute.entryPoint = view(e.name);
        made.pipeline.reset(wgpuDeviceCreateComputePipeline(device.handle(), &of_pipeline));
    });
    if (wrong || !made.pipeline) throw_of_entry_point(program, e, wrong);
    return made;
}

/// Returns a program with all of its entry points, compiled. A device keeps what it has compiled.
/// \throws device_error  if the device refuses the code or an entry point
inline std::shared_ptr<const Compiled> compiled(const Device& device, const wgsl::Program& program) {
    std::shared_ptr<const Compiled>& kept = device.compiled(program.code);
    if (kept) return kept;
    const OwnedModule module = compile(device, program);
    auto all = std::make_shared<Compiled>();
    for (const wgsl::EntryPoint& e : program.entry_points)
        all->pipelines.emplace(e.name, make_pipeline(device, program, module, e));
    return kept = all;
}

/// Returns entry point e with its buffers.
/// \param buffers  all buffers of the program; the buffer at binding 0 contains the uniforms
/// \param groups   number of workgroups with which the entry point will be dispatched
/// \throws device_error  if the device refuses the buffers; the message names the entry point
inline Kernel make_kernel(const Device& device, const wgsl::Program& program, const Compiled& compiled,
                          const wgsl::EntryPoint& e, const Buffers& buffers, wgsl::Dispatch groups) {
    std::vector<WGPUBindGroupEntry> bound;
    for (const auto& [binding, _] : e.bindings) {
        WGPUBindGroupEntry one{};
        one.binding = std::uint32_t(binding);
        one.buffer = buffers.at(binding).get();
        one.size = WGPU_WHOLE_SIZE;
        bound.push_back(one);
    }
    const Pipeline& of = compiled.pipelines.at(e.name);
    Kernel kernel{of.pipeline.get(), {}, groups};
    const auto wrong = objection(device, [&] {
        WGPUBindGroupDescriptor of_group{};
        of_group.layout = of.layout.get();
        of_group.entryCount = bound.size();
        of_group.entries = bound.data();
        kernel.bind_group.reset(wgpuDeviceCreateBindGroup(device.handle(), &of_group));
    });
    if (wrong || !kernel.bind_group) throw_of_entry_point(program, e, wrong);
    return kernel;
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
