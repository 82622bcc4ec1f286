/// \file Writes the points and meshes of a run as a USD stage with a time sample for each state, in the background if
/// you like.
#pragma once

#include <firn/io/background.hpp>
#include <firn/io/file_series.hpp>
#include <firn/io/series_file-inl.hpp>
#include <firn/io/usd.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

inline constexpr std::string_view usd_list_begin = "string firn_series = '''";

/// Returns the files of a UsdSeries, which its stage lists.
/// \throws io_error  if the stage cannot be read or was not written by a UsdSeries
[[gnu::cold]] inline std::vector<SeriesEntry> read_usd_list(const std::filesystem::path& path) {
    const std::string text = bytes_of_list(path);
    const std::size_t begin = text.find(usd_list_begin), first = begin + usd_list_begin.size();
    const std::size_t end = begin == std::string::npos ? begin : text.find("'''", first);
    if (end == std::string::npos)
        throw io_error(sentence("The stage ", path, " has no list of states; it was not written by a UsdSeries."));
    return entries_in(std::string_view(text).substr(first, end - first), path);
}

}  // namespace detail

/// A USD stage NAME.usda with a time sample for each time at which states were written. Houdini, Blender and Omniverse
/// open it as one animated stage:
///
///     firn::BackgroundSeries<float, firn::UsdSeries> series("out", "run");
///     …
///     std::vector<firn::UsdPrim<float>> prims = series.spare();
///     prims.resize(2);
///     prims[0].name = "water";
///     firn::state_of(simulation.set<0>(), prims[0].state);
///     prims[1].name = "cloth";
///     firn::state_of(simulation.set<1>(), prims[1].state);
///     series.write(std::move(prims));
///
/// The samples of each time are in a file of their own, NAME_0000.usda, NAME_0001.usda, …, which is a stage of one
/// time. NAME.usda declares the prims and takes their values from these files by value clips, USD's way for large
/// effects: in one text file, the samples of a second attribute would come after all samples of the first, so nothing
/// could be added to its end; and of sublayers, only the strongest one with samples of an attribute is asked. NAME.usda
/// is also the manifest of the clips. Between two times, an attribute has the value of the earlier one.
///
/// After each write() the stage is valid and complete up to this time, even if the program is killed. All files must be
/// moved together.
/// \see FileSeries for what happens to an older series of the same name
class UsdSeries {
public:
    using Options = UsdOptions;  ///< Options for writing the stage.
    /// What write() takes: the prims of one time.
    template <state_scalar S>
    using Frame = std::vector<UsdPrim<S>>;

    /// Makes the folder `directory` if this folder does not exist. No file is written yet.
    /// \param directory  the folder for the files of the stage
    /// \param name       the part NAME of the file names. The root prim has this name, with '_' for each character that
    ///                   is no letter of ASCII and no digit.
    /// \param options    options for writing the stage
    /// \throws parameter_error  if `name` is empty, is longer than 200 bytes, or contains '/', '.', '@', quotes,
    ///                          backslashes or control characters
    /// \throws io_error         if the folder cannot be made
    UsdSeries(std::filesystem::path directory, const std::string& name, UsdOptions options = {})
        : files_(std::move(directory), name, ".usda", name + ".usda", detail::read_usd_list),
          root_(detail::usd_name_of(name)),
          options_(std::move(options)) {
        if (name.find_first_of("@'\"\\") != std::string::npos)
            throw parameter_error(
                sentence("The name of a USD stage is '", name, "'; give one without '@', quotes and backslashes."));
    }

    /// Continues a stage that exists on disk, with the same prims and options. \see FileSeries::go_on_from
    /// \param time  samples up to and including this time [s] are kept
    /// \throws io_error  if the stage cannot be read, or if it was not written by a UsdSeries
    void go_on_from(double time) { files_.go_on_from(time); }

    /// Writes the samples of the next time. Returns the path of their file.
    /// \param prims  the same prims each time, of the same type and with the same primvars; how many points and facets
    ///               they have may change, also to none
    /// \throws parameter_error  if write_usd() refuses the prims, if their time is not later than that of the samples
    ///                          before, or if their names, types or fields are other ones than before
    /// \throws io_error         if a file cannot be written. The stage is then as before, and the next call of write()
    ///                          uses the same file name.
    template <state_scalar S>
    std::filesystem::path write(const std::vector<UsdPrim<S>>& prims) {
        const double time = detail::check_usd_prims(prims, options_);
        if (size() > 0 && !(code_of(time) > code_of(entries().back().time)))
            throw parameter_error(sentence("The states have the time ", time, " s, and the stage ", path(), " goes to ",
                                           entries().back().time, " s already; write later states."));
        std::string declared = detail::usd_declarations(prims, options_);
        if (!declared_.empty() && declared != declared_)
            throw parameter_error(sentence("The prims for ", path(),
                                           " differ from those of the times before; give the "
                                           "same names, types and fields. A mesh that may lose all its facets needs "
                                           "UsdPrim::type."));
        const std::filesystem::path file = files_.write(
            time, [&](const std::filesystem::path& to) { detail::write_usd_stage(to, root_, prims, options_); },
            [&](const std::filesystem::path& to, const std::vector<SeriesEntry>& all) {
                write_stage(to, all, declared);
            });
        declared_ = std::move(declared);
        return file;
    }
    /// Writes the samples of one prim, named `particles`, or `surface` if the state has facets and three dimensions.
    /// \throws parameter_error, io_error  as the other write()
    template <state_scalar S>
    std::filesystem::path write(const State<S>& state) {
        const bool mesh = state.dimension == 3 && !state.facets.empty();
        return write(std::vector<UsdPrim<S>>{{mesh ? "surface" : "particles", state}});
    }

    /// Returns the path of the stage, NAME.usda.
    std::filesystem::path path() const { return files_.path(); }
    /// Returns the number of times that the stage has.
    std::size_t size() const { return files_.size(); }
    /// Returns the files of the samples, in the order of their times.
    const std::vector<SeriesEntry>& entries() const { return files_.entries(); }

private:
    double code_of(double time) const { return detail::time_code(time, options_); }

    /// Writes NAME.usda.
    [[gnu::cold]] void write_stage(const std::filesystem::path& path, const std::vector<SeriesEntry>& entries,
                                   const std::string& declared) const {
        std::string active, files, times;
        for (std::size_t i = 0; i < entries.size(); ++i) {
            const std::string code = detail::exact_text(code_of(entries[i].time)), comma = i > 0 ? ", " : "";
            active += comma + "(" + code + ", " + std::to_string(i) + ")";
            files += comma + "@./" + entries[i].file + "@";
            times += comma + "(" + code + ", " + code + ")";
        }
        std::string data = "        ";
        data += detail::usd_list_begin;
        data += detail::series_text(entries) + "'''\n";
        AtomicFile file(path);
        file.write(detail::usd_header(root_, options_, detail::exact_text(code_of(entries.front().time)),
                                      detail::exact_text(code_of(entries.back().time)), data));
        file.write("def Xform \"" + root_ + "\" (\n    clips = {\n        dictionary default = {\n");
        file.write("            double2[] active = [" + active + "]\n");
        file.write("            asset[] assetPaths = [" + files + "]\n");
        file.write("            asset manifestAssetPath = @./" + path.filename().string() + "@\n");
        file.write("            string primPath = \"/" + root_ + "\"\n");
        file.write("            double2[] times = [" + times + "]\n        }\n    }\n)\n{\n");
        file.write(declared + "}\n");
        file.commit();
    }

    FileSeries files_;
    std::string root_;
    UsdOptions options_;
    std::string declared_;
};

}  // namespace firn::inline FIRN_BUILD
