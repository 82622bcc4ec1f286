/// \file Writes a state whose particles are on many ranks to one file. The file has the same bytes for any number of
/// ranks, and those of a file that firn::write_state() writes without MPI.
///
/// The particles of a run lie in space order: a rank has those of its part of space. In the file they are in the order
/// of their ids. So each array is sent to the ranks that write it: rank r writes the r-th part of the ids, at the
/// array's offset in the file. HDF5 chooses the offsets on rank 0, where everything except the large arrays is built in
/// memory, by the code that writes files without MPI.
#pragma once

#include <firn/io/hash_stream.hpp>
#include <firn/io/state_writer-inl.hpp>
#include <firn/mpi/row_exchange.hpp>
#include <firn/mpi/shared_file.hpp>

#include <deque>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

namespace detail {

/// The hashes of arrays of which each rank has some rows: rank 0 hashes its rows and sends the state of the computation
/// to rank 1, and so on.
class HashChain {
public:
    explicit HashChain(const Communicator& all) : all_(all), tag_(all.next_tag()) {}

    /// Adds an array. All ranks add the same arrays in the same order. A rank does not wait for later ranks.
    /// \param rows  this rank's rows
    void add(const firn::detail::StateArray& rows) {
        firn::detail::HashStream stream;
        firn::detail::HashStream::Bytes bytes;
        if (all_.rank() > 0) {
            MPI_Recv(bytes.data(), int(bytes.size()), MPI_BYTE, all_.rank() - 1, tag_, all_.get(), MPI_STATUS_IGNORE);
            stream.go_on_from(bytes);
        }
        stream.add(rows.bytes(), bytes_of(rows.kind));
        if (all_.rank() + 1 < all_.size()) {
            bytes = stream.bytes();
            MPI_Send(bytes.data(), int(bytes.size()), MPI_BYTE, all_.rank() + 1, tag_, all_.get());
        }
        hashes_.push_back(stream.hash());
    }
    /// Returns the hashes of the whole arrays, in the order in which they were added. Collective.
    std::vector<std::uint64_t> whole() {
        MPI_Bcast(hashes_.data(), int(hashes_.size()), MPI_UINT64_T, all_.size() - 1, all_.get());
        return hashes_;
    }

private:
    const Communicator& all_;
    int tag_;
    std::vector<std::uint64_t> hashes_;
};

/// Checks that the ranks give the same state, apart from their particles.
template <class S>
void check_alike(const Communicator& all, const State<S>& mine, const StateOptions& options) {
    firn::detail::HashedRecord record;
    record.add(std::uint64_t(options.compression)).add(options.fields.size());
    for (const std::string& name : options.fields) record.add(name);
    firn::detail::StateOutline outline(mine);
    outline.id = {};
    outline.body = {};
    for (auto& field : outline.fields) {
        field.values = {};
        record.add(field.name);
    }
    for (auto& table : outline.tables) {
        if (firn::detail::is_spread_table(table.name)) table.values = {};
        record.add(table.name);
    }
    record.add(firn::detail::digest_of(outline, [](std::string_view) { return true; }));
    const std::uint64_t hash = record.hash();
    if (all.min(hash) != all.max(hash))
        throw_together<parameter_error>(
            all, 0,
            "The states of the ranks differ in more than their particles. Give all ranks the state of the same "
            "simulation at the same time, and the same options.");
}

/// Checks the state of one rank.
template <class S>
void check_part(const State<S>& mine) {
    if (!mine.facets.empty())
        throw usage_error("The state has facets. States of nets are written without MPI, by firn::write_state().");
    for (std::size_t i = 1; i < mine.id.size(); ++i)
        if (mine.id[i] <= mine.id[i - 1])
            throw parameter_error(sentence("The ids of the state are not in ascending order: ", mine.id[i], " follows ",
                                           mine.id[i - 1], ". Give a state as state_of() makes it."));
    for (const StateTable& table : mine.tables) {
        const bool is_slot = table.name == "slot", is_blocks = table.name == "blocks";
        if ((is_slot && (table.columns != 1 || table.values.size() != mine.size())) ||
            (is_blocks && table.columns != mine.dimension + 2))
            throw parameter_error(sentence("The table '", table.name,
                                           "' of the state is not one that state_of() makes: ", "it has ",
                                           table.values.size(), " values in ", table.columns, " columns."));
    }
}

/// The writing of one state by all ranks.
template <state_scalar S>
class StateOfRanks {
public:
    StateOfRanks(const Communicator& all, const State<S>& mine, const StateOptions& options)
        : all_(all),
          mine_(mine),
          options_(options),
          whole_(mine),
          exchange_(all, even_shares(all, mine.id)),
          particles_(all.sum(std::uint64_t(mine.size()))),
          part_{std::uint64_t(all.rank()), std::uint64_t(all.size())},
          first_slot_(all.all(std::int64_t(all.sum_before(std::uint64_t(mine.size()))))),
          outcome_(all),
          hashes_(all) {}

    /// Writes the state. Collective.
    void write(const std::filesystem::path& path) {
        SharedFile file(all_, path);
        file_ = &file;
        outline_whole();
        build();
        put_arrays();
        finish();
        file.commit(outcome_);
    }

private:
    /// Where the rows of an array go.
    struct Place {
        std::optional<std::uint64_t> offset;  ///< in the file [bytes]; nullopt: rank 0 gives them to HDF5
        std::uint64_t rows_of_piece = 1;      ///< rows that rank 0 gives to HDF5 at once
        const firn::detail::OpenDataset* dataset = nullptr;  ///< on rank 0
    };

    /// Turns whole_ into the outline of the whole state, whose arrays are elsewhere.
    void outline_whole() {
        const auto n = std::size_t(particles_);
        whole_.id.move_elsewhere(n);
        whole_.body.move_elsewhere(n);
        for (auto& field : whole_.fields) field.values.move_elsewhere(n * std::size_t(field.components));
        for (auto& table : whole_.tables)
            if (firn::detail::is_spread_table(table.name))
                table.values.move_elsewhere(std::size_t(all_.sum(std::uint64_t(table.values.count))));
    }

    /// Builds the file without the arrays on rank 0, and tells all ranks where the arrays go.
    void build() {
        if (all_.rank() == 0) on_hdf5([&] { built_.emplace(whole_, options_, std::nullopt); });
        outcome_.settle();
        std::string places;
        if (built_)
            for (const auto& open : built_->open()) {
                const std::uint64_t row_bytes = std::max<std::uint64_t>(1, open.columns * sizeof(double));
                places += open.path + '\n' + (open.offset ? std::to_string(*open.offset) : "-") + '\n' +
                          std::to_string(open.rows_of_chunk > 0 ? open.rows_of_chunk
                                                                : (std::uint64_t(1) << 20) / row_bytes + 1) +
                          '\n';
            }
        std::istringstream text(all_.text_of(0, places));
        for (std::string name, offset, rows; std::getline(text, name);) {
            std::getline(text, offset);
            std::getline(text, rows);
            Place& place = places_[name];
            if (offset != "-") place.offset = std::stoull(offset);
            place.rows_of_piece = std::stoull(rows);
        }
        if (built_)
            for (const auto& open : built_->open()) places_[open.path].dataset = &open;
    }

    void put_arrays() {
        std::vector<std::int64_t> ids = exchange_.move(std::span(mine_.id), 1);
        order_ = order_of_ids(ids, exchange_.incoming());
        ids = in_order(std::move(ids), 1, order_);
        outcome_.attempt([&] {
            for (std::size_t i = 1; i < ids.size(); ++i)
                if (ids[i] == ids[i - 1]) throw parameter_error(sentence("Two particles have the id ", ids[i], "."));
            if (ids.size() != part_.count(particles_))
                throw parameter_error("Particles of different ranks have the same id.");
        });
        outcome_.settle();
        // All sends begin now, so that no rank waits for what another does with an earlier array.
        std::deque<RowExchange::Sends> sends;
        const auto send = [&](const auto& values, std::size_t columns) {
            const int tag = all_.next_tag();
            exchange_.send(std::span(values), columns, tag, sends.emplace_back());
            return tag;
        };
        const StateTable *slot = nullptr, *blocks = nullptr;
        for (const StateTable& table : mine_.tables) {
            if (table.name == "slot") slot = &table;
            if (table.name == "blocks") blocks = &table;
        }
        const int body_tag = send(mine_.body, 1), slot_tag = slot ? send(slot->values, 1) : 0;
        std::vector<int> tags;
        for (const auto& field : mine_.fields)
            tags.push_back(options_.writes(field.name) ? send(field.values, std::size_t(field.components)) : 0);

        put_rows<std::int64_t>("/VTKHDF/PointData/id", ids, 1, 1);
        ids = {};
        put_rows<std::int32_t>("/VTKHDF/PointData/body", moved(mine_.body, 1, body_tag), 1, 1);
        if (slot) {
            std::vector<std::int64_t> slots = exchange_.receive<std::int64_t>(slot->values, 1, slot_tag);
            for (const RowsOfRank& rows : exchange_.incoming())
                for (std::size_t i = rows.first; i < rows.first + rows.count; ++i)
                    slots[i] += first_slot_[std::size_t(rows.rank)];
            put_rows<std::int64_t>("/firn/tables/slot", in_order(std::move(slots), 1, order_), 1, 1);
        }
        if (blocks) put_blocks(*blocks);
        for (std::size_t f = 0; f < mine_.fields.size(); ++f) {
            const StateField<S>& field = mine_.fields[f];
            if (!options_.writes(field.name)) continue;
            const auto columns = std::size_t(field.components);
            put_rows<S>(field.name == "position" ? "/VTKHDF/Points" : "/VTKHDF/PointData/" + field.name,
                        moved(field.values, columns, tags[f]), columns,
                        mine_.dimension == 2 && columns == 2 ? 3 : columns);
        }
        put_cells();
    }

    template <class T>
    std::vector<T> moved(const std::vector<T>& values, std::size_t columns, int tag) const {
        return in_order(exchange_.receive(std::span<const T>(values), columns, tag), columns, order_);
    }

    /// Puts this rank's rows of an array of which the rank has the part `part_`.
    /// \param to_columns  the number of columns in the file; columns that the array lacks are zeros
    template <class T>
    void put_rows(const std::string& path, const std::vector<T>& rows, std::size_t columns, std::size_t to_columns) {
        hashes_.add(rows);
        const T* const whole = columns == to_columns ? rows.data() : nullptr;
        put<T>(path, part_.first(particles_), part_.count(particles_), particles_, to_columns, whole,
               [&](std::uint64_t first, std::uint64_t count, T* to) {
                   for (std::uint64_t i = 0; i < count; ++i)
                       for (std::size_t c = 0; c < to_columns; ++c)
                           to[i * to_columns + c] = c < columns ? rows[(first + i) * columns + c] : T(0);
               });
    }
    void put_blocks(const StateTable& table) {
        const auto columns = std::size_t(table.columns);
        std::vector<std::int64_t> rows = table.values;
        for (std::size_t at = columns - 2; at < rows.size(); at += columns)
            rows[at] += first_slot_[std::size_t(all_.rank())];
        hashes_.add(rows);
        const std::uint64_t count = rows.size() / columns;
        put<std::int64_t>("/firn/tables/blocks", all_.sum_before(count), count, all_.sum(count), columns, rows.data(),
                          [&](std::uint64_t first, std::uint64_t many, std::int64_t* to) {
                              std::copy_n(rows.data() + first * columns, many * columns, to);
                          });
    }
    /// Puts the cells: one vertex for each particle.
    void put_cells() {
        const std::uint64_t first = part_.first(particles_), count = part_.count(particles_);
        const auto put_numbers = [&](const char* path, std::uint64_t here, std::uint64_t whole) {
            put<std::int64_t>(path, first, here, whole, 1, nullptr,
                              [&](std::uint64_t from, std::uint64_t many, std::int64_t* to) {
                                  std::iota(to, to + many, std::int64_t(first + from));
                              });
        };
        put<std::uint8_t>("/VTKHDF/Types", first, count, particles_, 1, nullptr,
                          [](std::uint64_t, std::uint64_t many, std::uint8_t* to) {
                              std::fill_n(to, many, firn::detail::vtk_vertex);
                          });
        put_numbers("/VTKHDF/Connectivity", count, particles_);
        const bool is_last = all_.rank() + 1 == all_.size();
        put_numbers("/VTKHDF/Offsets", count + (is_last ? 1 : 0), particles_ + 1);
    }

    /// Puts rows of an array into the file, or sends them to rank 0, which gives them to HDF5.
    /// \param first  the first of this rank's rows in the file
    /// \param count  the number of this rank's rows
    /// \param whole  the number of rows of all ranks
    /// \param direct  the rows; nullptr if only `fill` has them
    /// \param fill   fill(i, k, to) writes the rows i, …, i + k − 1 of this rank to `to`
    template <class T, class Fill>
    void put(const std::string& path, std::uint64_t first, std::uint64_t count, std::uint64_t whole,
             std::size_t columns, const T* direct, const Fill& fill) {
        const auto found = places_.find(path);
        if (found == places_.end()) return;  // an array without numbers
        const Place& place = found->second;
        if (!place.offset) return gather<T>(place, first, count, whole, columns, fill);
        outcome_.attempt([&] {
            const std::uint64_t at = *place.offset + first * columns * sizeof(T);
            if (direct) return file_->write(at, std::as_bytes(std::span(direct, std::size_t(count) * columns)));
            const std::uint64_t rows = (std::uint64_t(1) << 20) / (columns * sizeof(T));
            std::vector<T> some(std::size_t(std::min(rows, count)) * columns);
            for (std::uint64_t i = 0; i < count; i += rows) {
                const std::uint64_t many = std::min(rows, count - i);
                fill(i, many, some.data());
                file_->write(at + i * columns * sizeof(T),
                             std::as_bytes(std::span<const T>(some).first(std::size_t(many) * columns)));
            }
        });
    }

    /// Sends rows to rank 0, which gives them to HDF5 in pieces of place.rows_of_piece rows.
    template <class T, class Fill>
    void gather(const Place& place, std::uint64_t first, std::uint64_t count, std::uint64_t whole, std::size_t columns,
                const Fill& fill) {
        const int tag = all_.next_tag();
        const std::uint64_t piece = place.rows_of_piece;
        const std::vector<std::uint64_t> firsts = all_.all(first);
        std::vector<T> some(std::size_t(std::min(piece, all_.rank() == 0 ? whole : count)) * columns);
        // Calls f(row, rows) for the rows of a rank, so that no call has rows of two pieces.
        const auto for_pieces = [piece](std::uint64_t from, std::uint64_t to, const auto& f) {
            for (std::uint64_t row = from; row < to;) {
                const std::uint64_t end = std::min(to, (row / piece + 1) * piece);
                f(row, end - row);
                row = end;
            }
        };
        if (all_.rank() > 0) {
            for_pieces(first, first + count, [&](std::uint64_t row, std::uint64_t rows) {
                fill(row - first, rows, some.data());
                MPI_Send(some.data(), int(rows * columns * sizeof(T)), MPI_BYTE, 0, tag, all_.get());
            });
            return;
        }
        for (int rank = 0; rank < all_.size(); ++rank) {
            const std::uint64_t end = rank + 1 < all_.size() ? firsts[std::size_t(rank) + 1] : whole;
            for_pieces(firsts[std::size_t(rank)], end, [&](std::uint64_t row, std::uint64_t rows) {
                T* const to = some.data() + row % piece * columns;
                if (rank == 0)
                    fill(row, rows, to);
                else
                    MPI_Recv(to, int(rows * columns * sizeof(T)), MPI_BYTE, rank, tag, all_.get(), MPI_STATUS_IGNORE);
                if ((row + rows) % piece == 0 || row + rows == whole) {
                    const std::uint64_t start = (row + rows - 1) / piece * piece;
                    on_hdf5([&] { give(*place.dataset, some, start, row + rows - start); });
                }
            });
        }
    }
    /// Gives rows of a dataset to HDF5.
    template <class T>
    static void give(const firn::detail::OpenDataset& open, const std::vector<T>& rows, std::uint64_t from,
                     std::uint64_t many) {
        const std::string tried = "write the dataset " + open.path;
        const hsize_t first[2] = {from, 0}, count[2] = {many, open.columns};
        const int rank = open.columns > 1 ? 2 : 1;
        const hdf5::Dataspace here(H5Screate_simple(rank, count, nullptr), tried),
            there(H5Dget_space(open.dataset.id()), tried);
        hdf5::check(H5Sselect_hyperslab(there.id(), H5S_SELECT_SET, first, nullptr, count, nullptr), tried);
        hdf5::check(
            H5Dwrite(open.dataset.id(), hdf5::Number<T>::memory(), here.id(), there.id(), H5P_DEFAULT, rows.data()),
            tried);
    }

    /// Computes the digest, and writes all that is not in large arrays on rank 0.
    void finish() {
        const std::vector<std::uint64_t> hashes = hashes_.whole();
        if (all_.rank() > 0) return;
        // In the order of put_arrays(). The hash of an array without numbers is not used.
        auto next = hashes.begin();
        whole_.id.hash = *next++;
        whole_.body.hash = *next++;
        for (const char* name : {"slot", "blocks"})
            for (auto& table : whole_.tables)
                if (table.name == name) table.values.hash = *next++;
        for (auto& field : whole_.fields)
            if (options_.writes(field.name)) field.values.hash = *next++;
        const auto writes = [&](std::string_view name) { return options_.writes(name); };
        on_hdf5([&] { built_->finish(firn::detail::digest_of(whole_, writes)); });
        outcome_.attempt([&] {
            built_->image().for_ranges(
                [&](std::uint64_t offset, std::span<const std::byte> bytes) { file_->write(offset, bytes); });
        });
    }

    /// Calls f(), which uses HDF5.
    template <class F>
    void on_hdf5(const F& f) {
        outcome_.attempt([&] { hdf5::naming_file(file_->path(), f); });
    }

    const Communicator& all_;
    const State<S>& mine_;
    const StateOptions& options_;
    firn::detail::StateOutline whole_;
    RowExchange exchange_;
    std::uint64_t particles_;               // of all ranks
    RowsPart part_;                         // the rows that this rank writes
    std::vector<std::int64_t> first_slot_;  // of each rank
    std::vector<std::uint32_t> order_{};    // of the rows received. \see order_of_ids
    Outcome outcome_;
    HashChain hashes_;
    SharedFile* file_ = nullptr;
    std::optional<firn::detail::StateFile> built_{};  // on rank 0
    std::map<std::string, Place> places_{};           // by path in the HDF5 file
};

}  // namespace detail

/// Writes a state whose particles are on many ranks to one HDF5 file. Collective.
///
///     firn::mpi::write_state(simulation.execution.communicator(), "state.hdf", firn::state_of(simulation));
///
/// The file has the same bytes for any number of ranks; firn::write_state() writes the same bytes in a run without MPI.
/// With compression, the fields and the digest are the same, but perhaps not the bytes. If a rank fails, no new file is
/// left, and an old file at `path` is unchanged.
///
/// The ranks must see the same file system, and be able to write to different places of one file at the same time, as
/// with Lustre, BeeGFS, GPFS or a local disk. In addition to the memory of its state, a rank needs two to three times
/// the memory of the largest field for its share of the particles; rank 0 also needs a few megabytes, and with
/// compression as much memory as the file has bytes, because it compresses for all.
/// \param all      the ranks
/// \param path     the name of the file, which should end in .hdf; that of rank 0 counts
/// \param mine     the state of this rank: its particles in ascending order of their ids, and everything else as on all
///                 ranks. The ranks have consecutive intervals of the curve through all blocks. \see before_on_curve
/// \param options  the compression, and the names of the fields to write; complete_every has no effect here
/// \throws usage_error      if the state has facets
/// \throws parameter_error  as firn::write_state(), and if the states of the ranks do not fit together
/// \throws io_error         if the file cannot be written (folder missing, disk full, …). All ranks throw the same
///                          error; it names a rank that failed unless all did.
template <state_scalar S>
void write_state(const Communicator& all, const std::filesystem::path& path, const State<S>& mine,
                 const StateOptions& options = {}) {
    detail::together(all, [&] {
        firn::detail::check_before_writing(mine, options);
        detail::check_part(mine);
    });
    detail::check_alike(all, mine, options);
    detail::StateOfRanks<S>(all, mine, options).write(path);
}

}  // namespace firn::inline FIRN_BUILD::mpi
