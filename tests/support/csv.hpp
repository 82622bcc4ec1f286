/// \file Reading the reference numbers: comma-separated, the first line names the columns, `#` begins a comment.
#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace csv {

using Row = std::map<std::string, std::string>;

/// The rows of tests/reference/NAME, by the names of their columns.
inline std::vector<Row> read(const std::string& name) {
    std::ifstream file(std::string(FIRN_TEST_REFERENCE_DIR) + "/" + name);
    if (!file) throw std::runtime_error("no reference file " + name);
    const auto split = [](const std::string& line) {
        std::vector<std::string> cells;
        std::stringstream stream(line);
        for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
        return cells;
    };
    std::vector<std::string> columns;
    std::vector<Row> rows;
    for (std::string line; std::getline(file, line);) {
        if (line.empty() || line[0] == '#') continue;
        const auto cells = split(line);
        if (columns.empty()) {
            columns = cells;
            continue;
        }
        if (cells.size() != columns.size()) throw std::runtime_error("a broken line in " + name + ": " + line);
        Row row;
        for (std::size_t c = 0; c < cells.size(); ++c) row[columns[c]] = cells[c];
        rows.push_back(row);
    }
    if (rows.empty()) throw std::runtime_error("no numbers in " + name);
    return rows;
}

inline double number(const Row& row, const std::string& column) { return std::stod(row.at(column)); }

}  // namespace csv
