/// \file Runs a WGSL program of firn on a GPU.
///
///     webgpu::Device device;
///     const auto program = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 3>(material, walls);
///     webgpu::Host host(device, program, wgsl::make_inputs<3>(program, domain, particles, dt, device.limits()));
///     host.initialise();
///     host.step(100);
///     host.check();
///     host.advance(0.1);  // [s], in steps at their bound
///     const std::vector<float> velocities = host.read("velocity");  // [m/s]; x, y, z of each particle
///
/// For the programs of a firn::Simulation there is on_gpu.hpp.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/stage/time_step.hpp>
#include <firn/webgpu/pipeline.hpp>
#include <firn/webgpu/status.hpp>
#include <firn/wgsl/inputs.hpp>
#include <firn/wgsl/manifest.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <type_traits>

namespace firn::inline FIRN_BUILD::webgpu {

namespace detail {

/// The name of type T in WGSL; nullptr if a buffer cannot contain values of type T.
template <class T>
constexpr const char* wgsl_name = nullptr;
template <>
inline constexpr const char* wgsl_name<float> = "f32";
template <>
inline constexpr const char* wgsl_name<std::int32_t> = "i32";
template <>
inline constexpr const char* wgsl_name<std::uint32_t> = "u32";

}  // namespace detail

/// A compiled WGSL program and its buffers on a GPU, ready to take steps.
///
/// In a buffer with values of particles, the c-th value (from 0) of particle i is at index c * capacity + i, where
/// capacity is the uniform of this name. Steps run asynchronously; functions that read from the device wait until all
/// steps are done. Each function that uses the device throws device_error if the device was lost, or if it has refused
/// an earlier command.
class Host {
public:
    /// Entry points, each of a Host, in the order to run them.
    using Sequence = std::vector<std::pair<Host*, std::string>>;

    static constexpr int in_one_submission = 16;  ///< Number of steps that the device is given at once.
    static constexpr int between_checks = 256;    ///< Number of steps between two looks at the status.

    /// Compiles the program unless the device has compiled its text before, makes the buffers of the program, and
    /// writes the inputs into these buffers. Call initialise() before the first step.
    /// \param device   GPU on which to run
    /// \param program  the program, from wgsl::make_program(); the Host keeps a copy
    /// \param inputs   the inputs, from wgsl::make_inputs(), made for this program and for device.limits()
    /// \param grid     another Host, for other particles on a grid of the same nodes: its buffers of the grid are used
    /// \throws parameter_error  if the program exceeds a limit of the device (see wgsl::check_fits())
    /// \throws device_error     if the device refuses the code (the message has the line), or if the device has not
    ///                          enough memory
    /// \throws usage_error      if the inputs were made for a different program, or for another grid
    Host(const Device& device, const wgsl::Program& program, const wgsl::Inputs& inputs, const Host* grid = nullptr)
        : device_(device), program_(std::make_unique<wgsl::Program>(program)), uniforms_(*program_) {
        take_uniforms(inputs);
        count_out(inputs);
        compiled_ = detail::compiled(device_, *program_);
        constexpr WGPUBufferUsage storage = WGPUBufferUsage_Storage | WGPUBufferUsage_CopyDst | WGPUBufferUsage_CopySrc;
        buffers_[0] = detail::make_buffer(device_, "uniforms", program_->uniform_bytes,
                                          WGPUBufferUsage_Uniform | WGPUBufferUsage_CopyDst);
        if (grid && (grid->nodes_ != nodes_ || grid->blocks_ != blocks_))
            throw usage_error("Sets of particles on one grid have the same nodes.");
        for (const wgsl::Buffer& b : program_->buffers) {
            if (grid && !wgsl::is_of_particles(b)) {
                wgpuBufferAddRef(grid->buffer(b.name));
                buffers_[b.binding].reset(grid->buffer(b.name));
            } else {
                buffers_[b.binding] =
                    detail::make_buffer(device_, b.name, std::max<std::uint64_t>(4, 4 * numbers(b)), storage);
            }
        }
        for (const wgsl::EntryPoint& e : program_->entry_points)
            kernels_[e.name] = detail::make_kernel(device_, *program_, *compiled_, e, buffers_, groups_of(e));
        for (const auto& [name, values] : inputs.buffers) write_buffer(name, values);
        if (!grid) clear_error();
    }

    /// Returns the number of particles: the value of the uniform "particles". This value comes from the inputs or from
    /// the last call of set("particles", …).
    std::uint32_t particles() const { return particles_; }
    /// Returns the total number of steps that calls of step() have started so far.
    long steps() const { return steps_; }
    /// Returns the WebGPU handle of a buffer, for example to draw the particles in the buffer. The Host owns the
    /// handle: do not release it.
    /// \throws usage_error  if the program has no buffer of this name
    WGPUBuffer buffer(const std::string& name) const { return buffers_.at(program_->buffer(name).binding).get(); }

    /// Returns whether take() can have these inputs in place of a new Host of the program, on the same grid.
    bool is_for(const wgsl::Program& program, const wgsl::Inputs& inputs, const Host* grid = nullptr) const {
        return program.code == program_->code && program.distances.size() == program_->distances.size() &&
               has_room_for(inputs) && (!grid || grid->buffer("nodes") == buffer("nodes"));
    }
    /// Replaces the uniforms and the contents of buffers by those of inputs for as many particles and nodes.
    /// \throws usage_error  if the inputs were made for a different program, or for more or fewer particles or nodes
    void take(const wgsl::Inputs& inputs) {
        take_uniforms(inputs);
        if (!has_room_for(inputs))
            throw usage_error(
                "The inputs have more or fewer particles or nodes than those that the Host was made for.");
        particles_ = inputs.particles;
        uniforms_changed_ = true;
        for (const auto& [name, values] : inputs.buffers) write_buffer(name, values);
    }
    /// Clears the error, for particles whose stress is known, in place of initialise().
    /// \param steps  number of steps that the run has taken so far
    /// \param sets   the report of each set of particles, in the order of the uniform "set_number"
    /// \param time   time that the run has reached [s]
    void begin(std::uint64_t steps, const std::vector<G2PReport>& sets, double time = 0) {
        std::vector<std::uint32_t> words = detail::words_at(*program_, time);
        words.at(17) = std::uint32_t(steps);  // a filter of volume ratios counts them
        for (std::size_t k = 0; k < sets.size(); ++k) {
            const std::size_t of_set = std::size_t{wgsl::detail::first_set_word} + k * wgsl::detail::words_of_set;
            words.at(of_set) = sets[k].sort_needed;
            words.at(of_set + 3) = std::bit_cast<std::uint32_t>(float(sets[k].signal_speed));
            words.at(2) = std::max(words.at(2), words.at(of_set + 3));
        }
        write_buffer("status", words);
    }
    /// Lets the next step count the places of a set of particles from the blocks in which they are, as the CPU does in
    /// steps that sort.
    void sort_next(std::size_t set) {
        write_word(std::size_t{wgsl::detail::first_set_word} + set * wgsl::detail::words_of_set, std::uint32_t{1});
    }

    /// Sets the largest acceleration of the last step [m/s²], which bounds the next one: for another gravity.
    void set_acceleration(float size) { write_word(19, size); }

    /// Sets the time that the run has reached [s], if the program keeps it for a material that asks.
    void set_time(double time) {
        if (!program_->keeps_time) return;
        const TimeLeft<float> split = time_left(time);
        write_word(wgsl::detail::time_word, split.high);
        write_word(wgsl::detail::time_low_word, split.low);
    }

    /// Computes the stress [Pa] of each particle from the particle's state, and clears the error. Call initialise()
    /// before the first step, and again after you have written states of particles.
    /// \param time  time that the run has reached [s]
    void initialise(double time = 0) {
        clear_error(time);
        run({"initialise"});
    }

    /// Takes `count` steps. The function may return before the GPU has done the steps. But after every 256 steps of one
    /// call of step(), the function calls check(): this waits until these steps are done, and throws if a step has
    /// failed.
    /// \param count   number of steps
    /// \param sorted  whether P2G sorts the particles by block and adds them up in workgroup memory, instead of adding
    ///                them directly to the grid. Both ways give the same bits.
    void step(int count = 1, bool sorted = false) {
        const std::vector<std::string> order = wgsl::step_order_of(*program_, sorted);
        for (int done = 0; done < count;) {
            const int some = std::min(in_one_submission, count - done);
            run(order, some);
            done += some;
            steps_ += some;
            if (done % between_checks == 0) check();
        }
    }

    /// Takes steps until `duration` [s] has passed: each is the bound of the time step, the last one is shortened. On a
    /// device without contraction these are the steps that firn::Simulation::advance() takes with
    /// FixedPoint<std::int32_t>{.float_steps = true}, to the bit. The uniforms "time_step" and "bound_time_step" count
    /// for nothing here. The function waits until the steps are done, and throws what check() throws if one has failed.
    ///
    /// If nothing bounds a step, it takes all the time. What the program does not know cannot bound its steps: set the
    /// uniform "boundary_speed" to the largest speed of the boundary [m/s], as firn::largest_speed() returns it. A
    /// boundary that moves from place to place stays where the uniforms put it; advance then by times in which it
    /// hardly moves.
    /// \return  the time steps that were taken [s]
    /// \throws parameter_error  if the duration is negative or not finite
    /// \throws particle_error   if the bound is so small that steps do not change the time
    std::vector<float> advance(double duration, bool sorted = false) {
        firn::detail::check_duration<float>(duration);
        Advance advance(sequence(wgsl::step_order_of(*program_, sorted)), duration);
        std::vector<float> taken;
        double time = 0;
        for (int most = in_one_submission; !advance.arrived();) {
            const std::vector<float> steps = advance.take(most);
            for (const float dt : steps) {
                if (!(time + double(dt) > time)) throw_no_step(dt, time);
                time += double(dt);
            }
            taken.insert(taken.end(), steps.begin(), steps.end());
            check(advance.status());
            if (steps.empty()) throw_no_step(0, time);
            most = advance.wanted(steps.back());
        }
        return taken;
    }

    /// Steps of a Host at their bound, within a time, which advance() takes. While it exists, the uniforms "time_step"
    /// and "bound_time_step" are its own; other uniforms may be set between its steps, for a boundary that moves.
    class Advance {
    public:
        /// \param step      the entry points of a step, the first of which is "begin_step"
        /// \param duration  the time after which the program arrives [s], at least 0
        Advance(Sequence step, double duration) : Advance(std::move(step), time_left(duration)) {}
        /// \param left  the time after which the program arrives, as left() of an earlier Advance returned it
        Advance(Sequence step, const TimeLeft<float>& left)
            : step_(std::move(step)), first_(*step_.at(0).first), left_(left) {
            for (const auto& [host, _] : step_)
                if (std::ranges::none_of(before_, [&](const Before& b) { return b.host == host; }))
                    before_.push_back({host, host->value_of("time_step"), host->value_of("bound_time_step")});
            bound(std::numeric_limits<float>::max());
            first_.write_time_left(left);
            status_.time_left = double(left.high) + double(left.low);
        }
        /// Gives the uniforms their values back.
        ~Advance() {
            for (const Before& b : before_) b.host->set_steps(b.time_step, b.bounded);
            take_until(0);
        }
        Advance(const Advance&) = delete;
        Advance& operator=(const Advance&) = delete;

        /// Bounds the steps from now on, besides what the program knows.
        /// \param longest  the longest step [s]
        void bound(float longest) {
            for (const Before& b : before_) b.host->set_steps({double(longest)}, {2});
        }
        /// Lets take() stop before the first step that leaves no more time than this.
        /// \param left  the least time to be left [s]; 0: none
        void take_until(float left) {
            least_ = left;
            for (const Before& b : before_) b.host->set("least_time_left", {double(left)});
        }
        /// Takes steps until the program arrives, at most `most`, from 1 to 256. Waits for them; look at status(),
        /// then.
        /// \return  the steps [s], with one that has failed
        std::vector<float> take(int most) {
            for (int begun = 0; begun < most; begun += in_one_submission)
                run(step_, std::min(most - begun, int{in_one_submission}));
            const std::vector<std::uint32_t> words = first_.read_buffer<std::uint32_t>("status");
            const std::uint32_t before = status_.steps;
            status_ = detail::status_of(words);
            left_ = {std::bit_cast<float>(words.at(wgsl::detail::time_left_word)),
                     std::bit_cast<float>(words.at(wgsl::detail::time_left_word + 1))};
            std::vector<float> steps;
            for (std::uint32_t k = before; k < status_.steps; ++k)
                steps.push_back(std::bit_cast<float>(
                    words.at(std::size_t{wgsl::detail::first_logged_step} + k % wgsl::detail::logged_steps)));
            first_.steps_ += long(steps.size());
            return steps;
        }
        const Status& status() const { return status_; }           ///< Returns the status after the last step.
        const TimeLeft<float>& left() const { return left_; }      ///< Returns the time left, as the device has it.
        bool arrived() const { return !(status_.time_left > 0); }  ///< Returns whether no time is left.
        /// Returns how many steps of so many seconds to take next: those past the end do nothing, but take time, so no
        /// more than seem to be needed. At first, when no step is known (0), it is one submission.
        int wanted(float step) const {
            if (!(step > 0)) return in_one_submission;
            const double submissions =
                std::ceil((status_.time_left - double(least_)) / double(step) / in_one_submission);
            return int(std::clamp(submissions, 1.0, double(between_checks / in_one_submission))) * in_one_submission;
        }

    private:
        struct Before {
            Host* host;
            std::vector<double> time_step, bounded;  // its uniforms before
        };
        Sequence step_;
        Host& first_;
        TimeLeft<float> left_;
        float least_ = 0;  // time to be left [s]
        std::vector<Before> before_;
        Status status_{};
    };

    /// Returns a sequence of entry points of this Host, given by their names.
    Sequence sequence(const std::vector<std::string>& entry_points) {
        Sequence all;
        for (const std::string& name : entry_points) all.emplace_back(this, name);
        return all;
    }
    /// Runs a sequence of entry points, given by their names, on the GPU. Runs the whole sequence `times` times. The
    /// function returns before the GPU is done.
    /// \throws usage_error  if one of the names is not the name of an entry point of the program
    void run(const std::vector<std::string>& entry_points, int times = 1) { run(sequence(entry_points), times); }
    /// Runs a sequence of entry points of several Hosts of one device.
    /// \throws usage_error  if one of the names is not the name of an entry point of its Host's program
    static void run(const Sequence& sequence, int times = 1) {
        if (sequence.empty()) return;
        const Device& device = sequence.front().first->device_;
        const std::vector<const detail::Kernel*> kernels = kernels_of(sequence);
        const detail::OwnedEncoder encoder(wgpuDeviceCreateCommandEncoder(device.handle(), nullptr));
        const detail::OwnedPass pass(wgpuCommandEncoderBeginComputePass(encoder.get(), nullptr));
        for (int i = 0; i < times; ++i)
            for (const detail::Kernel* kernel : kernels) kernel->dispatch(pass);
        wgpuComputePassEncoderEnd(pass.get());
        detail::submit(device, encoder);
    }

    /// Sets the value of a uniform for the steps that follow. The units of all uniforms are in wgsl::Program::uniforms.
    /// Setting "time_step" [s] also sets "place_per_velocity".
    /// \param values  the components of the value: a single component, or one component for each axis
    /// \throws usage_error      if the program has no uniform of this name, or if `values` has more or fewer components
    ///                          than the uniform
    /// \throws parameter_error  if a value is not finite, does not fit the uniform's type or is not allowed for this
    ///                          uniform; or if the uniform is "nodes", "capacity", "blocks", "cells" or "cell_size" and
    ///                          its value would change
    void set(const std::string& name, const std::vector<double>& values) {
        require_allowed(program_->uniform(name), values);
        uniforms_.set(name, values);
        if (name == "particles") particles_ = std::uint32_t(values[0]);
        if (name == "time_step") wgsl::set_time_step(uniforms_, values[0], value_of("cell_size")[0]);
        uniforms_changed_ = true;
    }

    /// Sets the uniforms of a policy to its present parameters, for example after a boundary has moved. Grids of
    /// distances stay what they are.
    /// \param prefix  which policy it is: "material", "boundary", "field" or "transfer"
    /// \throws usage_error  if the program has no uniform for one of the parameters
    template <class Policy>
    void set_parameters(const Policy& policy, const std::string& prefix) {
        wgsl::set_parameters(uniforms_, policy, prefix);
        uniforms_changed_ = true;
    }

    /// Returns the values of one component ("velocity", "mass", …) for all particles: all values of particle 0, then
    /// all values of particle 1, … Waits for all steps so far. The units of all components are in
    /// wgsl::Buffer::components. A position is the sum of the components "corner" and "place", in cells from the
    /// domain's lower corner.
    /// \tparam T  float, std::int32_t or std::uint32_t, the type of the component's values
    /// \throws usage_error  if particles have no component of this name, or if the component's values are not of type T
    template <class T = float>
    std::vector<T> read(const std::string& component) {
        std::string names;
        for (const wgsl::Buffer& b : program_->buffers) {
            int row = 0;
            for (const wgsl::Component& c : b.components) {
                if (c.name == component) {
                    std::vector<T> values = read_rows<T>(b, row, c.count);
                    for (std::size_t i = 0; i < values.size(); ++i) values[i] += T(c.lacking(int(i) % c.count));
                    return values;
                }
                row += c.count;
                names += " " + c.name;
            }
        }
        throw usage_error("Particles have no component " + component + "; they have" + names + ".");
    }

    /// Returns all values of a buffer, in their order on the device. Waits for all steps so far. The buffer "state" has
    /// F − I and J − 1 of the fields F and J. \see wgsl::Component::less_one
    /// \tparam T  float, std::int32_t or std::uint32_t, the type of the buffer's values
    /// \throws usage_error  if the program has no buffer of this name, or if the buffer's values are not of type T
    template <class T = float>
    std::vector<T> read_buffer(const std::string& name) {
        const wgsl::Buffer& b = program_->buffer(name);
        require_type<T>(b);
        return detail::download<T>(device_, buffer(name), 0, numbers(b));
    }

    /// Replaces all values of a buffer.
    /// \tparam T      float, std::int32_t or std::uint32_t, the type of the buffer's values
    /// \param values  the new values, in their order on the device
    /// \throws usage_error  if the program has no buffer of this name, if the buffer's values are not of type T, or if
    ///                      `values` has more or fewer values than the buffer
    template <class T>
    void write_buffer(const std::string& name, const std::vector<T>& values) {
        device_.check();
        const wgsl::Buffer& b = program_->buffer(name);
        require_type<T>(b);
        if (values.size() != numbers(b))
            throw usage_error(
                sentence("The buffer ", name, " holds ", numbers(b), " numbers; ", values.size(), " were given."));
        wgpuQueueWriteBuffer(device_.queue(), buffer(name), 0, values.data(), values.size() * sizeof(T));
    }

    /// Returns the status after the last step. Waits for all steps so far.
    Status status() { return detail::status_of(read_buffer<std::uint32_t>("status")); }

    /// Throws if a step has failed; otherwise returns status(). Waits for all steps so far. After a step has failed,
    /// further steps change nothing until initialise() is called.
    /// \throws overflow_error   if the sum at a node could exceed the range of the integers
    /// \throws particle_error   if a particle is not finite or has left the domain; the message has the particle's
    ///                          index
    /// \throws parameter_error  if a mirrored wall lies on no plane of nodes, or less than 3 cells from another one
    /// \throws device_error     if the program reports an error code that firn does not know
    Status check() {
        const Status now = status();
        check(now);
        return now;
    }

private:
    friend class PassTimer;

    /// Returns what a sequence runs, and sends the uniforms.
    static std::vector<const detail::Kernel*> kernels_of(const Sequence& sequence) {
        sequence.front().first->device_.check();
        std::vector<const detail::Kernel*> kernels;
        for (const auto& [host, name] : sequence) {
            const auto found = host->kernels_.find(name);
            if (found == host->kernels_.end())
                throw usage_error("The program " + host->program_->name + " has no entry point " + name + ".");
            kernels.push_back(&found->second);
            host->send_uniforms();
        }
        return kernels;
    }

    bool has_room_for(const wgsl::Inputs& inputs) const {
        return inputs.particles == capacity_ && inputs.nodes == nodes_ && inputs.blocks == blocks_;
    }
    static_assert(between_checks <= wgsl::detail::logged_steps, "the log holds all steps between two looks at it");

    void set_steps(const std::vector<double>& time_step, const std::vector<double>& bounded) {
        uniforms_.set("time_step", time_step);
        uniforms_.set("bound_time_step", bounded);
        uniforms_changed_ = true;
    }
    void send_uniforms() {
        if (!std::exchange(uniforms_changed_, false)) return;
        const std::vector<std::byte> bytes = uniforms_.uniform_bytes();
        wgpuQueueWriteBuffer(device_.queue(), buffers_.at(0).get(), 0, bytes.data(), bytes.size());
    }

    /// Sets the time left, and the number of steps to 0.
    void write_time_left(const TimeLeft<float>& left) {
        constexpr int first = wgsl::detail::time_left_word;
        static_assert(wgsl::detail::steps_word == first + 2);
        const std::uint32_t words[] = {std::bit_cast<std::uint32_t>(left.high), std::bit_cast<std::uint32_t>(left.low),
                                       0};
        device_.check();
        wgpuQueueWriteBuffer(device_.queue(), buffer("status"), 4 * first, words, sizeof words);
    }

    [[noreturn]] static void throw_no_step(float dt, double time) {
        throw particle_error(sentence("The bound of the time step is ", dt, " s, ", time,
                                      " s after the advance began: too small to change the time, and larger steps are "
                                      "not stable."));
    }

    void check(const Status& now) const {
        if (now.error == 0) return;
        if (now.error > wgsl::error_sentences.size())
            throw device_error(sentence("The program ", program_->name, " reports the unknown error ", now.error, "."));
        const std::string where = now.particle == no_particle ? "" : sentence("particle ", now.particle, ", ");
        const std::string what =
            sentence(wgsl::error_sentences[now.error - 1], " (", where, "at the latest in step ", steps_, ")");
        detail::throw_error(now.error, what);
    }

    void take_uniforms(const wgsl::Inputs& inputs) {
        wgsl::Inputs names = inputs;
        for (const wgsl::Uniform& u : program_->uniforms) names.set(u.name, u.values);
        if (names.uniform_bytes() != wgsl::Inputs(*program_).uniform_bytes())
            throw usage_error("The inputs were made for another program, not for " + program_->name + ".");
        for (std::size_t k = 0; k < program_->uniforms.size(); ++k)
            uniforms_.set(program_->uniforms[k].name, inputs.uniform(k));
    }

    void count_out(const wgsl::Inputs& inputs) {
        const std::size_t D = std::size_t(program_->dimension);
        bool good = inputs.nodes.size() == D;
        for (std::size_t a = 0; good && a < D; ++a)
            good = inputs.nodes[a] % std::uint32_t(block_size) == 0 && inputs.nodes[a] == value_of("nodes")[a];
        if (!good)
            throw usage_error(sentence("The nodes of the inputs must be ", D, " multiples of ", block_size,
                                       " and equal the uniform 'nodes'."));
        const double capacity = value_of("capacity")[0];
        if (inputs.particles != value_of("particles")[0] || !(capacity >= inputs.particles))
            throw usage_error(sentence("The inputs have ", inputs.particles,
                                       " particles. That must equal the uniform 'particles' and not exceed the "
                                       "uniform 'capacity', ",
                                       capacity, "."));
        particles_ = inputs.particles;
        capacity_ = std::uint32_t(capacity);
        nodes_ = inputs.nodes;
        blocks_ = inputs.blocks;
        wgsl::check_fits(*program_, capacity_, nodes_, device_.limits(), blocks_);
    }

    /// Returns the number of items of the kind `per`, such as "particle" or "node". \see wgsl::Buffer::per,
    /// wgsl::EntryPoint::per
    std::uint64_t extent(const std::string& per) const {
        const std::uint64_t all = wgsl::stored_nodes(*program_, nodes_, blocks_);
        std::uint64_t along = 0, blocks = all;
        for (const std::uint32_t n : nodes_) {
            along += n;
            blocks /= std::uint32_t(block_size);
        }
        const auto across = [&](std::size_t axis) { return axis < nodes_.size() ? all / nodes_[axis] : 0; };
        for (const auto& [name, count] : {std::pair<const char*, std::uint64_t>{"particle", capacity_},
                                          {"particle_and_bin", wgsl::detail::words_of_bins(*program_, capacity_, all)},
                                          {"node", all},
                                          {"block", blocks},
                                          {"block_workgroup", blocks},
                                          {"axis_node", along},
                                          {"distance", program_->distances.size()},
                                          {"x_line", across(0)},
                                          {"y_line", across(1)},
                                          {"z_line", across(2)},
                                          {"program", 1},
                                          {"particle_set", 1},
                                          {"one_workgroup", 1}})
            if (per == name) return count;
        throw usage_error("The program " + program_->name + " has a buffer or an entry point per " + per +
                          ", which is unknown.");
    }
    std::size_t numbers(const wgsl::Buffer& b) const { return std::size_t(b.count) * extent(b.per); }

    wgsl::Dispatch groups_of(const wgsl::EntryPoint& e) const {
        const bool by_workgroup = e.per == "block_workgroup" || e.per == "one_workgroup";
        return wgsl::dispatch(extent(e.per), by_workgroup ? 1 : e.workgroup_size, device_.limits());
    }

    const std::vector<double>& value_of(const std::string& uniform) const {
        return uniforms_.uniform(std::size_t(&program_->uniform(uniform) - program_->uniforms.data()));
    }

    void require_allowed(const wgsl::Uniform& uniform, const std::vector<double>& values) const {
        const std::string& name = uniform.name;
        const bool whole = uniform.type.find("u32") != std::string::npos;
        const bool fixed =
            name == "nodes" || name == "capacity" || name == "blocks" || name == "cells" || name == "cell_size";
        const bool scale = name == "momentum_scale" || name == "mass_scale";
        int exponent = 0;
        for (const double x : values) {
            if (!std::isfinite(x) || (whole && (x < 0 || x > 4294967295.0 || x != std::floor(x))))
                throw parameter_error(
                    sentence("The uniform ", name, " is of type ", uniform.type, "; it cannot be ", x, "."));
            if (name == "time_step" && !(x > 0))
                throw parameter_error(sentence("The time step is ", x, " s; it must be positive."));
            if (name == "boundary_speed" && !(x >= 0))
                throw parameter_error(sentence("The speed of the boundary is ", x, " m/s; it cannot be negative."));
            if (scale && x != 0 && std::frexp(x, &exponent) != 0.5)
                throw parameter_error(
                    sentence("The ", name, " is ", x, "; it must be a power of two, or 0 to be chosen."));
            if (name == "particles" && x > capacity_)
                throw parameter_error(sentence(x, " particles do not fit into a capacity of ", capacity_, "."));
        }
        if (fixed && values != value_of(name))
            throw parameter_error(
                sentence("The uniform ", name, " cannot change: the buffers were made for its value."));
    }

    void clear_error(double time = 0) { write_buffer("status", detail::words_at(*program_, time)); }
    /// Writes a word of the buffer "status".
    template <class T>
    void write_word(std::size_t word, const T& value) {
        static_assert(sizeof value == sizeof(std::uint32_t));
        device_.check();
        wgpuQueueWriteBuffer(device_.queue(), buffer("status"), word * sizeof value, &value, sizeof value);
    }

    template <class T>
    void require_type(const wgsl::Buffer& b) const {
        static_assert(detail::wgsl_name<T> != nullptr, "buffers hold float, std::int32_t or std::uint32_t");
        if (b.type != detail::wgsl_name<T>)
            throw usage_error(sentence("The buffer ", b.name, " holds ", b.type, ", not ", detail::wgsl_name<T>, "."));
    }

    template <class T>
    std::vector<T> read_rows(const wgsl::Buffer& b, int row, int count) {
        require_type<T>(b);
        const std::size_t rows = std::size_t(count);
        const std::vector<T> lying =
            detail::download<T>(device_, buffer(b.name), std::uint64_t(row) * capacity_, rows * capacity_);
        std::vector<T> values(rows * particles_);
        for (std::size_t i = 0; i < particles_; ++i)
            for (std::size_t c = 0; c < rows; ++c) values[i * rows + c] = lying[c * capacity_ + i];
        return values;
    }

    Device device_;
    std::unique_ptr<const wgsl::Program> program_;
    wgsl::Inputs uniforms_;  // contains a pointer to *program_
    bool uniforms_changed_ = true;
    std::uint32_t particles_ = 0, capacity_ = 0;
    std::vector<std::uint32_t> nodes_;
    std::uint32_t blocks_ = 0;
    std::shared_ptr<const detail::Compiled> compiled_;
    detail::Buffers buffers_;
    std::map<std::string, detail::Kernel> kernels_;
    long steps_ = 0;
};

}  // namespace firn::inline FIRN_BUILD::webgpu
