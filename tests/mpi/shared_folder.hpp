/// \file A folder for a test on several ranks that writes files; removed at the end.
#pragma once

#include "support/temporary_folder.hpp"
#include <firn/mpi/communicator.hpp>

#include <fstream>
#include <optional>

/// An empty folder that all ranks know. When all ranks have left it, rank 0 removes it with all that is in it.
class SharedFolder {
public:
    explicit SharedFolder(const firn::mpi::Communicator& all) : all_(all) {
        if (all.rank() == 0) owned_.emplace();
        path_ = all.text_of(0, owned_ ? owned_->path().string() : std::string());
    }
    SharedFolder(const SharedFolder&) = delete;
    SharedFolder& operator=(const SharedFolder&) = delete;
    ~SharedFolder() { all_.barrier(); }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

private:
    const firn::mpi::Communicator& all_;
    std::optional<TemporaryFolder> owned_;  // on rank 0
    std::filesystem::path path_;
};

inline std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}
