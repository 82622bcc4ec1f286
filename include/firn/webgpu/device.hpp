/// \file A GPU, used through the C interface webgpu.h. Errors of the GPU become exceptions.
///
/// Any library that implements webgpu.h can be used, if its version of webgpu.h has string views (WGPUStringView) and
/// futures (WGPUFuture).
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>
#include <firn/wgsl/limits.hpp>

#include <webgpu/webgpu.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu {

/// Options of a Device: which GPU to choose, and which limits (sizes of buffers, …) to ask for.
struct DeviceOptions {
    bool low_power = false;      ///< whether to prefer the GPU that needs less power
    bool only_software = false;  ///< whether to use a software driver, which computes on the CPU
    /// Whether to ask for the highest limits that the GPU allows. If false, the device has the limits that every GPU
    /// guarantees.
    bool raise_limits = true;
    /// How the programs of on_gpu() round. If empty, they are exact, except for a software driver, where plain programs
    /// are so, too.
    std::optional<wgsl::Arithmetic> arithmetic{};
    /// Whether P2G of on_gpu() adds the particles of a block up in workgroup memory, see Host::step; the bits are the
    /// same. If empty, it does, except with a software driver, which takes twice as long for it.
    std::optional<bool> sums_by_block{};
    /// Limits that programs keep where those of the GPU are higher.
    wgsl::Limits at_most{std::numeric_limits<std::uint64_t>::max(), std::numeric_limits<std::uint64_t>::max(),
                         std::numeric_limits<std::uint32_t>::max(), std::numeric_limits<int>::max()};
    bool timestamps = false;  ///< whether to ask for timestamps, if the GPU has them. \see Device::has_timestamps
};

class Device;

namespace detail {

struct Compiled;  // a program, in pipeline.hpp

/// The deleter of the smart pointer Owned. It passes a WebGPU handle to the function `Release`.
template <auto Release>
struct Released {
    template <class T>
    void operator()(T* handle) const {
        Release(handle);
    }
};
/// A std::unique_ptr that owns a WebGPU handle. When the pointer is destroyed, it releases the handle.
template <class Handle, auto Release>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Released<Release>>;

using OwnedInstance = Owned<WGPUInstance, wgpuInstanceRelease>;
using OwnedAdapter = Owned<WGPUAdapter, wgpuAdapterRelease>;
using OwnedDevice = Owned<WGPUDevice, wgpuDeviceRelease>;
using OwnedQueue = Owned<WGPUQueue, wgpuQueueRelease>;
using OwnedBuffer = Owned<WGPUBuffer, wgpuBufferRelease>;
using OwnedModule = Owned<WGPUShaderModule, wgpuShaderModuleRelease>;
using OwnedLayout = Owned<WGPUBindGroupLayout, wgpuBindGroupLayoutRelease>;
using OwnedPipelineLayout = Owned<WGPUPipelineLayout, wgpuPipelineLayoutRelease>;
using OwnedPipeline = Owned<WGPUComputePipeline, wgpuComputePipelineRelease>;
using OwnedBindGroup = Owned<WGPUBindGroup, wgpuBindGroupRelease>;
using OwnedEncoder = Owned<WGPUCommandEncoder, wgpuCommandEncoderRelease>;
using OwnedQueries = Owned<WGPUQuerySet, wgpuQuerySetRelease>;
using OwnedPass = Owned<WGPUComputePassEncoder, wgpuComputePassEncoderRelease>;
using OwnedCommands = Owned<WGPUCommandBuffer, wgpuCommandBufferRelease>;

inline std::string text(WGPUStringView view) {
    if (!view.data) return {};
    return {view.data, view.length == WGPU_STRLEN ? std::strlen(view.data) : view.length};
}
inline WGPUStringView view(std::string_view text) { return {text.data(), text.size()}; }

/// The result and the message that a WebGPU callback receives.
template <class Result>
struct Answer {
    bool is_there = false;  // whether the callback has run
    Result result{};
    std::string message;

    void give(Result r, WGPUStringView m) {
        result = r;
        message = text(m);
        is_there = true;
    }
    /// Waits until the callback has run. Other callbacks that become due meanwhile run, too.
    void wait(WGPUInstance instance) {
        wgpuInstanceProcessEvents(instance);
        while (!is_there) {
            std::this_thread::sleep_for(std::chrono::microseconds(20));
            wgpuInstanceProcessEvents(instance);
        }
    }
};

/// The WebGPU handles of a device, and the messages of the errors that the device has reported. Callbacks may run until
/// the last handle is released; the callbacks for errors may run on any thread.
class DeviceState {
public:
    explicit DeviceState(const DeviceOptions& options) {
        instance.reset(wgpuCreateInstance(nullptr));
        if (!instance) throw device_error("The WebGPU library gives no instance.");
        request_adapter(options);
        request_device(options);
        queue.reset(wgpuDeviceGetQueue(device.get()));
        sums_by_block = options.sums_by_block.value_or(!is_software);
        arithmetic = options.arithmetic.value_or(is_software ? wgsl::Arithmetic::plain : wgsl::Arithmetic::exact);
        WGPULimits given{};
        wgpuDeviceGetLimits(device.get(), &given);
        limits = {given.maxStorageBufferBindingSize, given.maxBufferSize, given.maxComputeWorkgroupsPerDimension,
                  int(given.maxStorageBuffersPerShaderStage)};
        const wgsl::Limits& most = options.at_most;
        limits.storage_binding_bytes = std::min(limits.storage_binding_bytes, most.storage_binding_bytes);
        limits.buffer_bytes = std::min(limits.buffer_bytes, most.buffer_bytes);
        limits.groups_per_dimension = std::min(limits.groups_per_dimension, most.groups_per_dimension);
        limits.storage_buffers_per_stage = std::min(limits.storage_buffers_per_stage, most.storage_buffers_per_stage);
    }
    DeviceState(const DeviceState&) = delete;
    DeviceState& operator=(const DeviceState&) = delete;

    /// Throws if the device has reported an error.
    /// \throws device_error  if the device was lost, or if it has refused a command since the last call of this
    ///                       function
    void check() {
        wgpuInstanceProcessEvents(instance.get());
        const std::lock_guard lock(mutex_);
        if (lost_) throw device_error("The device was lost: " + *lost_);
        if (refused_) throw device_error("The device refused a command: " + *std::exchange(refused_, std::nullopt));
    }

private:
    // mutex_, lost_ and refused_ are declared before the handles, so that they are destroyed later: callbacks use them
    // until the last handle is released.
    std::mutex mutex_;
    std::optional<std::string> lost_, refused_;

public:
    OwnedInstance instance;
    OwnedAdapter adapter;
    OwnedDevice device;
    OwnedQueue queue;
    std::string name;
    bool is_software = false;
    wgsl::Arithmetic arithmetic;
    bool sums_by_block;
    wgsl::Limits limits;
    bool has_timestamps = false;
    std::map<std::string, std::shared_ptr<const Compiled>> compiled{};  // the key is the program's text

private:
    Answer<WGPURequestAdapterStatus> ask_for_adapter(const DeviceOptions& options, bool fallback) {
        WGPURequestAdapterOptions asked{};
        asked.featureLevel = WGPUFeatureLevel_Core;
        asked.powerPreference = options.low_power ? WGPUPowerPreference_LowPower : WGPUPowerPreference_HighPerformance;
        asked.forceFallbackAdapter = fallback;
        Answer<WGPURequestAdapterStatus> answer;
        WGPURequestAdapterCallbackInfo callback{};
        callback.mode = WGPUCallbackMode_AllowProcessEvents;
        callback.callback = [](WGPURequestAdapterStatus status, WGPUAdapter given, WGPUStringView message, void* self,
                               void* to) {
            static_cast<DeviceState*>(self)->adapter.reset(given);
            static_cast<Answer<WGPURequestAdapterStatus>*>(to)->give(status, message);
        };
        callback.userdata1 = this;
        callback.userdata2 = &answer;
        wgpuInstanceRequestAdapter(instance.get(), &asked, callback);
        answer.wait(instance.get());
        return answer;
    }

    void request_adapter(const DeviceOptions& options) {
        auto answer = ask_for_adapter(options, options.only_software);
        // Dawn takes only the driver that it may bring along for a fallback, not one that VK_ICD_FILENAMES names.
        if (!adapter && options.only_software) answer = ask_for_adapter(options, false);
        WGPUAdapterInfo info{};
        if (adapter) {
            wgpuAdapterGetInfo(adapter.get(), &info);
            name = text(info.description.length ? info.description : info.device);
            is_software = info.adapterType == WGPUAdapterType_CPU;
            wgpuAdapterInfoFreeMembers(info);
        }
        // If there is no driver, some libraries offer an adapter that computes nothing (backend Null).
        if (answer.result != WGPURequestAdapterStatus_Success || info.backendType == WGPUBackendType_Null || !adapter)
            throw device_error(sentence(
                "There is no GPU that WebGPU can use here", answer.message.empty() ? "" : " (" + answer.message + ")",
                ". WebGPU needs a driver, on Linux one for Vulkan. VK_ICD_FILENAMES selects a driver, "
                "which may be a software driver."));
        if (options.only_software && !is_software)
            throw device_error("WebGPU finds no software driver here, only " + name +
                               ". VK_ICD_FILENAMES selects a driver.");
    }

    void request_device(const DeviceOptions& options) {
        WGPULimits most{};
        wgpuAdapterGetLimits(adapter.get(), &most);
        WGPUDeviceDescriptor asked{};
        asked.requiredLimits = options.raise_limits ? &most : nullptr;
        // Older versions of webgpu.h have the number 3 for this feature, and the library may be older than the header.
        // Where 3 is another feature, to ask for it does no harm.
        std::vector<WGPUFeatureName> features{WGPUFeatureName_TimestampQuery, WGPUFeatureName(3)};
        std::erase_if(features, [&](WGPUFeatureName feature) {
            return !options.timestamps || !wgpuAdapterHasFeature(adapter.get(), feature);
        });
        asked.requiredFeatureCount = features.size();
        asked.requiredFeatures = features.data();
#ifdef WGPU_DAWN_TOGGLES_DESCRIPTOR_INIT
        const char* const roundings[] = {"timestamp_quantization"};  // to 0.1 ms, against spies in web pages
        WGPUDawnTogglesDescriptor exact{};
        exact.chain.sType = WGPUSType_DawnTogglesDescriptor;
        exact.disabledToggleCount = std::size(roundings);
        exact.disabledToggles = roundings;
        if (options.timestamps) asked.nextInChain = &exact.chain;
#endif
        asked.deviceLostCallbackInfo.mode = WGPUCallbackMode_AllowProcessEvents;
        asked.deviceLostCallbackInfo.callback = [](WGPUDevice const*, WGPUDeviceLostReason, WGPUStringView message,
                                                   void* self, void*) {
            static_cast<DeviceState*>(self)->keep(&DeviceState::lost_, message);
        };
        asked.deviceLostCallbackInfo.userdata1 = this;
        asked.uncapturedErrorCallbackInfo.callback = [](WGPUDevice const*, WGPUErrorType, WGPUStringView message,
                                                        void* self, void*) {
            static_cast<DeviceState*>(self)->keep(&DeviceState::refused_, message);
        };
        asked.uncapturedErrorCallbackInfo.userdata1 = this;
        Answer<WGPURequestDeviceStatus> answer;
        WGPURequestDeviceCallbackInfo callback{};
        callback.mode = WGPUCallbackMode_AllowProcessEvents;
        callback.callback = [](WGPURequestDeviceStatus status, WGPUDevice given, WGPUStringView message, void* self,
                               void* to) {
            static_cast<DeviceState*>(self)->device.reset(given);
            static_cast<Answer<WGPURequestDeviceStatus>*>(to)->give(status, message);
        };
        callback.userdata1 = this;
        callback.userdata2 = &answer;
        wgpuAdapterRequestDevice(adapter.get(), &asked, callback);
        answer.wait(instance.get());
        if (answer.result != WGPURequestDeviceStatus_Success || !device)
            throw device_error(sentence("The GPU ", name, " gives no device: ", answer.message));
    }

    /// Stores the message in the member to which `what` points, unless this member already contains a message. The
    /// first message is kept, because the first error may be the cause of later errors.
    void keep(std::optional<std::string> DeviceState::* what, WGPUStringView message) {
        const std::lock_guard lock(mutex_);
        if (!(this->*what)) this->*what = text(message);
    }
};

bool gives_timestamps(const Device& device);

}  // namespace detail

/// A GPU, or a software driver that acts as one.
///
/// Copies of a Device share one WebGPU device. The WebGPU device is released when all copies, and all Hosts made
/// with them, are destroyed. Only one thread at a time may use the WebGPU device.
class Device {
public:
    /// Chooses a GPU and requests a device from it.
    /// \throws device_error  if there is no usable GPU, or if the GPU provides no device; the message tells why
    explicit Device(const DeviceOptions& options = {}) : state_(std::make_shared<detail::DeviceState>(options)) {
        state_->has_timestamps = options.timestamps && detail::gives_timestamps(*this);
    }

    /// Returns the name of the GPU.
    const std::string& name() const { return state_->name; }
    /// Returns whether the device is a software driver, which computes on the CPU.
    bool is_software() const { return state_->is_software; }
    /// Returns how the programs of on_gpu() round. \see DeviceOptions::arithmetic
    wgsl::Arithmetic arithmetic() const { return state_->arithmetic; }
    /// Returns whether P2G of on_gpu() adds up in workgroup memory. \see DeviceOptions::sums_by_block
    bool sums_by_block() const { return state_->sums_by_block; }
    /// Returns the limits of the device. Pass them to wgsl::make_inputs(), which throws if the program exceeds them.
    const wgsl::Limits& limits() const { return state_->limits; }
    /// Returns whether the device gives timestamps: whether DeviceOptions::timestamps asked for them, and the GPU has
    /// them. \see time_passes
    bool has_timestamps() const { return state_->has_timestamps; }
    /// Throws if the device has reported an error. A Host calls this function whenever it uses the device.
    /// \throws device_error  if the device was lost, or if it has refused a command since the last call of this
    ///                       function
    void check() const { state_->check(); }

    /// \name Handles
    /// @{

    /// Returns the webgpu.h handle of the device, of its queue or of its instance, for work besides the simulation,
    /// such as drawing the particles in a simulation's buffers. The Device owns the handle: do not release the handle.
    WGPUDevice handle() const { return state_->device.get(); }
    WGPUQueue queue() const { return state_->queue.get(); }
    WGPUInstance instance() const { return state_->instance.get(); }
    /// @}

    /// Returns the place for the compiled program with a text, which the device keeps; it is empty at first.
    std::shared_ptr<const detail::Compiled>& compiled(const std::string& code) const { return state_->compiled[code]; }

private:
    std::shared_ptr<detail::DeviceState> state_;
};

namespace detail {

/// Calls create(), and returns the first error message that the device reports for the commands in `create`. Returns
/// nullopt if there is no error. `create` must not throw.
template <class F>
std::optional<std::string> objection(const Device& device, const F& create) {
    // Internal errors are reported as errors of no scope: wgpu-native has no filter for them.
    constexpr WGPUErrorFilter filters[] = {WGPUErrorFilter_Validation, WGPUErrorFilter_OutOfMemory};
    for (const WGPUErrorFilter filter : filters) wgpuDevicePushErrorScope(device.handle(), filter);
    create();
    std::optional<std::string> first;
    for (std::size_t i = 0; i < std::size(filters); ++i) {
        Answer<WGPUErrorType> answer;
        WGPUPopErrorScopeCallbackInfo callback{};
        callback.mode = WGPUCallbackMode_AllowProcessEvents;
        callback.callback = [](WGPUPopErrorScopeStatus, WGPUErrorType type, WGPUStringView message, void* to, void*) {
            static_cast<Answer<WGPUErrorType>*>(to)->give(type, message);
        };
        callback.userdata1 = &answer;
        wgpuDevicePopErrorScope(device.handle(), callback);
        answer.wait(device.instance());
        if (!answer.message.empty() && !first) first = answer.message;
    }
    device.check();
    return first;
}

/// Returns room for timestamps of the device, or what is wrong if it gives none.
inline std::pair<OwnedQueries, std::string> make_timestamps(const Device& device, std::uint32_t count) {
    WGPUQuerySetDescriptor asked{};
    asked.type = WGPUQueryType_Timestamp;
    asked.count = count;
    OwnedQueries made;
    const auto wrong = objection(device, [&] { made.reset(wgpuDeviceCreateQuerySet(device.handle(), &asked)); });
    if (wrong || !made) return {nullptr, wrong.value_or("no reason is given")};
    return {std::move(made), ""};
}
inline bool gives_timestamps(const Device& device) { return make_timestamps(device, 2).first != nullptr; }

/// Returns a new buffer of `bytes` bytes.
/// \param name  label of the buffer in error messages
/// \throws device_error  if the device cannot allocate the buffer
inline OwnedBuffer make_buffer(const Device& device, const std::string& name, std::uint64_t bytes,
                               WGPUBufferUsage usage) {
    WGPUBufferDescriptor asked{};
    asked.label = view(name);
    asked.usage = usage;
    asked.size = bytes;
    OwnedBuffer buffer;
    const auto wrong = objection(device, [&] { buffer.reset(wgpuDeviceCreateBuffer(device.handle(), &asked)); });
    if (wrong || !buffer)
        throw device_error(sentence("The device cannot allocate ", bytes, " bytes for the buffer '", name,
                                    "': ", wrong.value_or("no reason is given")));
    return buffer;
}

inline void submit(const Device& device, const OwnedEncoder& encoder) {
    const OwnedCommands commands(wgpuCommandEncoderFinish(encoder.get(), nullptr));
    const WGPUCommandBuffer all[] = {commands.get()};
    wgpuQueueSubmit(device.queue(), std::size(all), all);
}

/// Returns `count` values of type T from a buffer, beginning with the value at index `first`. Waits for all commands
/// that were submitted so far.
/// \throws device_error  if the device was lost, if it has refused a command, or if the buffer cannot be read
template <class T>
std::vector<T> download(const Device& device, WGPUBuffer from, std::uint64_t first, std::size_t count) {
    device.check();
    std::vector<T> numbers(count);
    if (count == 0) return numbers;
    const std::size_t bytes = count * sizeof(T);
    const OwnedBuffer staging =
        make_buffer(device, "staging", bytes, WGPUBufferUsage_MapRead | WGPUBufferUsage_CopyDst);
    const OwnedEncoder encoder(wgpuDeviceCreateCommandEncoder(device.handle(), nullptr));
    wgpuCommandEncoderCopyBufferToBuffer(encoder.get(), from, first * sizeof(T), staging.get(), 0, bytes);
    submit(device, encoder);
    Answer<WGPUMapAsyncStatus> answer;
    WGPUBufferMapCallbackInfo callback{};
    callback.mode = WGPUCallbackMode_AllowProcessEvents;
    callback.callback = [](WGPUMapAsyncStatus status, WGPUStringView message, void* to, void*) {
        static_cast<Answer<WGPUMapAsyncStatus>*>(to)->give(status, message);
    };
    callback.userdata1 = &answer;
    wgpuBufferMapAsync(staging.get(), WGPUMapMode_Read, 0, bytes, callback);
    answer.wait(device.instance());
    device.check();
    const void* mapped =
        answer.result == WGPUMapAsyncStatus_Success ? wgpuBufferGetConstMappedRange(staging.get(), 0, bytes) : nullptr;
    if (!mapped) throw device_error("A buffer cannot be read from the device: " + answer.message);
    std::memcpy(numbers.data(), mapped, bytes);
    return numbers;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::webgpu
