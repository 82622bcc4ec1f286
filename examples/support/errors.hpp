/// \file Runs the body of main() and prints an exception as an error message.
#pragma once

#include <exception>
#include <functional>
#include <iostream>

namespace example {

inline int report_errors(const std::function<int()>& body) {
    try {
        return body();
    } catch (const std::exception& problem) {
        std::cerr << "error: " << problem.what() << std::endl;
        return 1;
    }
}

}  // namespace example
