# Fails when a source file includes by a path that climbs ("../") or starts at the root of the file system; when it does not
# begin with its own header, where it has one: what comes first must compile on its own; and when it instantiates a
# decomposition outside firmware/metrology/fit: each costs seconds of compile time wherever it stands. Unit tests and
# benchmarks may, as judges that share nothing with the solvers.
file(GLOB_RECURSE files ${ROOT}/protocol/*.[ch]pp ${ROOT}/board/*.[ch]pp ${ROOT}/drivers/*.[ch]pp
     ${ROOT}/firmware/*.[ch]pp ${ROOT}/tools/*.[ch]pp ${ROOT}/host-tests/*.[ch]pp)
set(climbing "")
set(late "")
set(decomposing "")
set(decomposition "<Eigen/(Cholesky|Dense|Eigen|Eigenvalues|LU|QR|SVD)>|<unsupported/Eigen/"
    "|Eigen::([A-Za-z]*(SVD|LLT|LDLT|LU|QR|EigenSolver)|CompleteOrthogonalDecomposition|umeyama)"
    "|[.](llt|ldlt|jacobiSvd|bdcSvd|lu|partialPivLu|fullPivLu|householderQr|colPivHouseholderQr|fullPivHouseholderQr"
    "|completeOrthogonalDecomposition|inverse|determinant|eigenvalues|operatorNorm)[(][)]")
string(REPLACE ";" "" decomposition "${decomposition}")
foreach(file IN LISTS files)
  file(STRINGS ${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](\\.\\./|/|.*/\\.\\./)")
  foreach(line IN LISTS lines)
    string(APPEND climbing "  ${file}: ${line}\n")
  endforeach()
  if(NOT file MATCHES "^${ROOT}/(firmware/metrology/fit|host-tests/(unit|scenario|bench|support))/")
    file(STRINGS ${file} lines REGEX "${decomposition}")
    foreach(line IN LISTS lines)
      string(STRIP "${line}" line)
      string(APPEND decomposing "  ${file}: ${line}\n")
    endforeach()
  endif()
  string(REGEX REPLACE "\\.cpp$" ".hpp" header ${file})
  if(file MATCHES "\\.cpp$" AND EXISTS ${header})
    get_filename_component(name ${header} NAME)
    file(STRINGS ${file} first REGEX "^[ \t]*#[ \t]*include" LIMIT_COUNT 1)
    if(NOT first MATCHES "[\"/]${name}\"")
      string(APPEND late "  ${file}: ${first}\n")
    endif()
  endif()
endforeach()
if(climbing)
  message(FATAL_ERROR "An include must name its room from the top:\n${climbing}")
endif()
if(late)
  message(FATAL_ERROR "A source must include its own header first:\n${late}")
endif()
if(decomposing)
  message(FATAL_ERROR "Only firmware/metrology/fit instantiates a decomposition: call one of the functions of "
                      "firmware/metrology/fit/decompositions.hpp, or add it there:\n${decomposing}")
endif()
