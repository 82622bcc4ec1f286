// The mesh of a program with one: the files that 06_emit_wgsl writes beside it. Loaded by programs that have a mesh.
import { fetched } from './scene.mjs';

const numbersIn = async (url, Type) => new Type(await (await fetched(url)).arrayBuffer());
const difference = (a, b) => a.map((x, k) => x - b[k]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The normals at vertices, of any length: the sum of those of the triangles around, weighted by their areas. */
function normalsOf(vertices, triangles) {
    const normals = new Float32Array(vertices.length), at = (v) => vertices.slice(3 * v, 3 * v + 3);
    for (let t = 0; t < triangles.length; t += 3) {
        const corners = [...triangles.subarray(t, t + 3)], [a, b, c] = corners.map(at);
        const normal = cross([...difference(b, a)], [...difference(c, a)]);
        for (const v of corners) normal.forEach((x, k) => { normals[3 * v + k] += x; });
    }
    return normals;
}

/** Reads the distances of a program's buffer, and for the picture the vertices [m], normals there, and triangles. */
export async function fetchMesh(url) {
    const [distances, vertices, triangles] = await Promise.all([['distances', Float32Array],
        ['vertices', Float32Array], ['triangles', Uint32Array]].map(([name, Type]) =>
        numbersIn(`${url}/${name}.bin`, Type)));
    return { distances, vertices, normals: normalsOf(vertices, triangles), triangles };
}
