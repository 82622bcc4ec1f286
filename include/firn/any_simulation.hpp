/// \file A simulation whose materials and policies are chosen at run time, by names.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/any/offer.hpp>
#include <firn/any/run.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/read_particles.hpp>

#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {
template <int D, class S, class Offer>
std::unique_ptr<AnyRun<D>> make_run(const SimulationChoice<D>& choice);
}  // namespace detail

/// A simulation of what a user of a program chooses while it runs: materials, transfer, kernel, force form, precision
/// and boundary. It has the bits of the Simulation that has the same types at compile time.
///
///     firn::SimulationChoice<3> choice;
///     choice.materials = {{.name = "sand", .properties = {{"young", 1e6}, {"friction_angle", 30}}}};
///     firn::AnySimulation<3> simulation(choice, firn::Offer<>{});
///     simulation.add(0, firn::sample_box<3>({0.4, 0.4, 0.4}, {0.6, 0.6, 0.6}, {.spacing = 0.01}), 1600);
///     simulation.advance(0.1);
///
/// It chooses among types that were compiled into the program, those of the Offer. One file of the program, such as the
/// one that makes it, includes firn/any/run_of.hpp, too, and compiles them.
///
/// Materials have the order of the offer in the sums of a step, whatever their order in the choice.
/// \tparam D  2 or 3
template <int D>
class AnySimulation {
public:
    static constexpr int dimension = D;  ///< The dimension: 2 or 3.

    /// Makes a simulation without particles.
    /// \param offer  the types to choose from
    /// \throws parameter_error  if the offer has not what is chosen, with a list of what it has; if a material has no
    ///                          property or parameter of a given name; or if a value is out of range
    template <class Offer>
    AnySimulation(SimulationChoice<D> choice, const Offer& offer) : choice_(std::move(choice)) {
        static_cast<void>(offer);
        [this]<class... S>(OfferedPrecisions<S...>) {
            std::vector<std::string> names;
            const auto look = [&]<class T>(std::type_identity<T>) {
                names.emplace_back(std::same_as<T, float> ? "float" : "double");
                if (choice_.precision == names.back()) run_ = detail::make_run<D, T, Offer>(choice_);
            };
            (look(std::type_identity<S>{}), ...);
            if (!run_) detail::throw_not_offered("precision", choice_.precision, names);
        }(typename Offer::precisions{});
        if (choice_.boundary)
            places_ = detail::places_of(*choice_.boundary, detail::names_of<D>(typename Offer::shapes{}));
    }
    /// Copies the simulation with its particles.
    AnySimulation(const AnySimulation& other)
        : choice_(other.choice_), places_(other.places_), run_(other.run_->copy()) {}
    AnySimulation(AnySimulation&&) noexcept = default;  ///< Takes the simulation over.
    /// Takes the simulation over, or a copy of it.
    AnySimulation& operator=(AnySimulation other) noexcept {
        choice_ = std::move(other.choice_);
        places_ = std::move(other.places_);
        run_ = std::move(other.run_);
        return *this;
    }

    /// Returns what was chosen, with the boundary as it is now.
    SimulationChoice<D> choice() const {
        SimulationChoice<D> now = choice_;
        if (now.boundary)
            for (std::size_t k = 0; k < places_.size(); ++k) (*now.boundary)[k] = boundary_part(k);
        now.gravity = run_->stepper().gravity;
        return now;
    }

    const std::string& precision() const { return choice_.precision; }  ///< Returns "float" or "double".
    const Domain<D>& domain() const { return choice_.domain; }          ///< Returns the domain.

    /// \name Time
    /// @{
    double time() const { return run_->stepper().time(); }                      ///< Returns the time [s].
    std::uint64_t steps() const { return run_->stepper().steps(); }             ///< Returns the number of steps so far.
    double last_time_step() const { return run_->stepper().last_time_step(); }  ///< Returns the last step [s].
    /// Takes one step. \see Simulation::step
    void step() { run_->step(); }
    /// Takes steps until `duration` [s] has passed. \see Simulation::advance
    void advance(double duration) { run_->advance(duration); }
    /// Returns the bound of the time step [s]. \see Simulation::stable_time_step
    double stable_time_step() { return run_->stable_time_step(); }
    /// Returns gravity [m/s²], to read or to change.
    Vec<double, D>& gravity() { return run_->stepper().gravity; }
    /// Returns the function that receives warnings, to change it. \see Simulation::warn
    std::function<void(const std::string&)>& warn() { return run_->stepper().warn; }
    /// Sets the time step [s]; 0: the bound.
    void set_fixed_time_step(double dt) {
        choice_.fixed_time_step = dt;
        with_run([&](auto& run) { run.fixed_time_step = dt; });
    }
    /// @}

    /// \name Sets of particles, numbered as the materials of the choice
    /// @{

    /// Returns the number of sets.
    std::size_t sets() const { return choice_.materials.size(); }
    /// Returns the number of the set of a material. \throws parameter_error  if no set has this material
    std::size_t set(std::string_view material) const {
        std::vector<std::string> names;
        for (std::size_t k = 0; k < sets(); ++k) {
            names.push_back(choice_.materials[k].name);
            if (names.back() == material) return k;
        }
        throw parameter_error(
            sentence("No set has the material '", material, "'; there are: ", detail::listed_names(names), "."));
    }
    /// Returns the name of the material of set k.
    const std::string& material_name(std::size_t k) const { return choice_.materials[checked(k)].name; }
    /// Returns the number of particles of set k.
    std::size_t particles(std::size_t k) const {
        std::size_t count = 0;
        with_store(k, [&](const auto& store) { count = store.size(); });
        return count;
    }
    /// Adds a body of uniform density [kg/m³] and velocity [m/s] to set k. \see SetAccess::add
    Body add(std::size_t k, const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
        return run_->add(checked(k), samples, density, velocity);
    }
    /// Adds a source to set k. \see SetAccess::add_source
    void add_source(std::size_t k, const Source<D>& source) { run_->add_source(checked(k), source); }
    /// Adds a sink to set k. \see SetAccess::add_sink
    void add_sink(std::size_t k, const Sink<D>& sink) { run_->add_sink(checked(k), sink); }
    /// Removes the particles of set k for which wanted(position [m], id) returns true, and returns their number.
    std::size_t remove_if(std::size_t k, const std::function<bool(const Vec<double, D>&, std::uint32_t)>& wanted) {
        return run_->remove_if(checked(k), wanted);
    }
    /// Returns the bodies of set k, in the order of their ids.
    const std::vector<Body>& bodies(std::size_t k) const { return run_->bodies(checked(k)); }
    /// Returns the total mass, momenta and energies of set k.
    Totals<D> totals(std::size_t k) const { return run_->totals(checked(k)); }
    /// Returns the parameters of the material of set k, as in states.
    std::vector<StateParameter> material(std::size_t k) const { return run_->material(checked(k)); }
    /// Changes parameters of the material of set k. \see SetAccess::edit_material
    /// \throws parameter_error  if it has no parameter of a name, or if a value is out of range; nothing is changed
    /// then
    void edit_material(std::size_t k, const std::vector<NamedNumber>& parameters) {
        run_->edit_material(checked(k), parameters);
    }

    /// Returns set k, in the precision of the run: a MaterialSet of its material, to be looked at or copied.
    std::variant<const SetOf<float, D>*, const SetOf<double, D>*> stored_set(std::size_t k) const {
        std::variant<const SetOf<float, D>*, const SetOf<double, D>*> set;
        checked(k);
        with_run([&](const auto& run) { set = &run.sets()[run_->index_of(k)]; });
        return set;
    }

    /// Returns the fields of the particles of set k, as in states.
    const FieldTable& fields(std::size_t k) const {
        const FieldTable* table = nullptr;
        with_store(k, [&](const auto& store) { table = &store.table(); });
        return *table;
    }
    /// Returns how many numbers a particle of set k has in a field.
    /// \param field  "position" [m], or the name of a field of fields(), such as "velocity" [m/s]
    /// \throws parameter_error  if there is no such field
    int components(std::size_t k, std::string_view field) const {
        if (field == "position") return D;
        return fields(k)[line_of(k, field)].components_in_state(D);
    }
    /// Returns the ids of the particles of set k, in ascending order.
    std::vector<std::uint32_t> ids(std::size_t k) const {
        std::vector<std::uint32_t> ids;
        with_store(k, [&](const auto& store) {
            const std::vector<std::uint32_t> slots = slots_by_id(store, choice_.threads);
            ids.resize(slots.size());
            for (std::size_t i = 0; i < slots.size(); ++i) ids[i] = store.id(slots[i]);
        });
        return ids;
    }
    /// Copies a field of the particles of set k, in the order of ids: the numbers of a particle one after the other,
    /// matrices row by row.
    /// \param to  memory for components() numbers of each particle
    /// \throws parameter_error  if there is no such field, or if `to` has another size
    template <std::floating_point T>
    void read(std::size_t k, std::string_view field, std::span<T> to) const {
        const auto count = std::size_t(components(k, field));
        check_size(k, field, to.size());
        with_store(k, [&]<class S>(const ParticleStore<S, D>& store) {
            const bool is_position = field == "position";
            const std::size_t line = is_position ? 0 : line_of(k, field);
            const std::vector<std::uint32_t> slots = slots_by_id(store, choice_.threads);
            detail::for_chunks(slots.size(), choice_.threads, [&](std::size_t first, std::size_t last) {
                const auto part = std::span(slots).subspan(first, last - first);
                if (is_position)
                    read_positions(store, part, to.data() + first * count);
                else
                    read_field(store, line, part, to.data() + first * count);
            });
        });
    }
    /// Sets a field of the particles of set k, in the order of ids. \see read
    /// \throws parameter_error  if there is no such field, if `from` has another size, or if a number is not finite;
    ///                          nothing is changed then
    template <std::floating_point T>
    void write(std::size_t k, std::string_view field, std::span<const T> from) {
        const auto count = std::size_t(components(k, field));
        check_size(k, field, from.size());
        for (const T number : from)
            if (!std::isfinite(number))
                throw parameter_error(
                    sentence("The field '", field, "' is given ", number, "; numbers must be finite."));
        const bool is_position = field == "position";
        const std::size_t line = is_position ? 0 : line_of(k, field);
        const auto write_to = [&]<class S>(ParticleStore<S, D>* store) {
            const std::vector<std::uint32_t> slots = slots_by_id(*store, choice_.threads);
            // Positions are written by one thread, as particles may come to blocks that the store does not know yet.
            const int threads = is_position ? 1 : choice_.threads;
            detail::for_chunks(slots.size(), threads, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i) {
                    const T* const mine = from.data() + i * count;
                    if (!is_position) {
                        store->set(line, slots[i], mine);
                        continue;
                    }
                    Vec<double, D> x{};
                    for (int a = 0; a < D; ++a) x[a] = double(mine[a]);
                    store->set_position(slots[i], x);
                }
            });
        };
        std::visit(write_to, run_->edit_particles(k));
    }
    /// @}

    /// \name Boundary
    /// @{

    /// Returns the number of parts of the chosen boundary.
    std::size_t boundary_parts() const { return places_.size(); }
    /// Returns a part of the boundary, where it is now. \param part  index in the choice
    BoundaryPart<D> boundary_part(std::size_t part) const {
        return run_->part((*choice_.boundary)[checked_part(part)], places_[part]);
    }
    /// Changes a part of the boundary: its place, its velocity, its friction, its size.
    /// \throws parameter_error  if `to` has another shape than the part, or if a value is out of range
    void set_boundary_part(std::size_t part, const BoundaryPart<D>& to) {
        const BoundaryPart<D>& from = (*choice_.boundary)[checked_part(part)];
        bool same = to.index() == from.index();
        if (const auto* named = std::get_if<Collider<NamedShape<D>>>(&to); named && same)
            same = named->shape.shape == std::get<Collider<NamedShape<D>>>(from).shape.shape;
        if (!same) throw parameter_error("A part of a boundary keeps its shape; give one of the same shape.");
        run_->set_part(to, places_[part]);
        (*choice_.boundary)[part] = to;
    }
    /// Lets the following steps measure reactions().
    void measure_reactions() {
        with_run([](auto& run) {
            if (!run.reactions) run.reactions.emplace();
        });
    }
    /// Returns the impulse and the angular impulse that a part of the boundary exerted on matter in the last step.
    /// \param part  index in the choice; walls are one part
    /// \throws usage_error  if no step has measured them
    Reaction<D> reaction(std::size_t part) const { return run_->reaction(places_[checked_part(part)]); }
    /// @}

    /// \name States
    /// @{

    /// Returns the state of set k, in the precision of the run. \see state_of
    AnyState state(std::size_t k) { return run_->state(checked(k)); }
    /// Restores set k from a state. \see firn::restore
    void restore(std::size_t k, const AnyState& state, Restart how = Restart::same_bits) {
        run_->restore(checked(k), state, how);
    }
    /// @}

private:
    std::size_t checked(std::size_t k) const {
        if (k >= sets())
            throw parameter_error(sentence("There is no set ", k, "; the choice has ", sets(), " materials."));
        return k;
    }
    std::size_t checked_part(std::size_t part) const {
        if (part >= places_.size())
            throw parameter_error(
                sentence("The chosen boundary has no part ", part, "; it has ", places_.size(), " parts."));
        return part;
    }
    template <class F>
    void with_run(const F& f) const {
        std::visit([&](auto* run) { f(*run); }, run_->run());
    }
    template <class F>
    void with_store(std::size_t k, const F& f) const {
        checked(k);
        with_run([&]<class S>(const RunOf<S, D>& run) {
            f(static_cast<const ParticleStore<S, D>&>(run.sets()[run_->index_of(k)].store()));
        });
    }
    std::size_t line_of(std::size_t k, std::string_view field) const {
        const FieldTable& table = fields(k);
        if (const std::size_t line = detail::field_index(table, field); line < table.size()) return line;
        std::vector<std::string> names{"position"};
        for (const FieldInfo& info : table) names.emplace_back(info.name);
        throw parameter_error(sentence("The particles of ", choice_.materials[k].name, " have no field '", field,
                                       "'; they have: ", detail::listed_names(names), "."));
    }
    void check_size(std::size_t k, std::string_view field, std::size_t size) const {
        const std::size_t needed = particles(k) * std::size_t(components(k, field));
        if (size != needed)
            throw parameter_error(sentence("The field '", field, "' of ", particles(k), " particles has ", needed,
                                           " numbers; memory for ", size, " is given."));
    }

    SimulationChoice<D> choice_;
    std::vector<detail::PlaceOfPart> places_;
    std::unique_ptr<detail::AnyRun<D>> run_;
};

}  // namespace firn::inline FIRN_BUILD
