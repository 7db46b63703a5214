using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Text;
using UnityEngine;

namespace Hairloom
{
    /// A level of detail in Unity's axes: x points the other way than in glTF, v of textures upwards.
    ///
    /// The file is read here, and not by an importer of meshes, for those sort triangles anew.
    public sealed class CardLevel
    {
        public string Name;
        public Vector3[] Positions;
        public Vector3[] Normals;

        /// Of the strands, from root to tip; w is 1.
        public Vector4[] Tangents;

        public Vector2[] Places;

        /// Ambient occlusion, and how far along the strands the vertex lies.
        public Vector2[] Occlusion;

        /// Corners of triangles from the inside to the outside of the hair.
        public int[] Front;

        /// The order for triangles that are seen from behind; the same one if the export has no other.
        public int[] Back;

        /// Height of the hair on the screen, of the screen's, below which the next level takes over.
        public float EndHeight;

        /// Whether triangles and vertices are those that Hairloom wrote, in their order.
        public bool IsAsWritten;

        /// warn: gets a sentence for each thing that is wrong; what can be shown is shown.
        public static CardLevel[] All(string glb, Sidecar sidecar, Action<string> warn)
        {
            var file = new Glb(glb);
            var backs = BackIndices(glb, sidecar, warn);
            var levels = new List<CardLevel>();
            foreach (var each in sidecar.levels)
            {
                var level = file.Level(each);
                level.Back = backs == null || each.buffer_back_first < 0 || !level.IsAsWritten
                    ? level.Front
                    : level.Turned(backs, each, glb);
                levels.Add(level);
            }
            var heights = EndHeights(file.Coverage(sidecar.levels[0].node), levels.Count);
            for (var number = 0; number < levels.Count; number++)
                levels[number].EndHeight = heights[number];
            if (!levels.All(level => level.IsAsWritten))
                warn($"{glb}: another program has changed it, so hair may show holes; "
                    + "use the file that Hairloom wrote");
            return levels.ToArray();
        }

        /// Unity takes levels only where each ends at a smaller size than the one before. The file lets two end at
        /// the same size where the first of them is never needed: here it is shown within a thousandth of that.
        /// Where the file says nothing each ends at half the size of the last one.
        static float[] EndHeights(float[] coverage, int count)
        {
            var heights = new float[count];
            var last = 1.0f / 0.999f;
            for (var number = 0; number < count - 1; number++)
            {
                var own = number < coverage.Length ? Mathf.Sqrt(coverage[number]) : 0.0f;
                last = own > 0.0f ? Mathf.Min(own, 0.999f * last) : 0.5f * last;
                heights[number] = last;
            }
            return heights;  // the last one is shown at any size
        }

        static int[] BackIndices(string glb, Sidecar sidecar, Action<string> warn)
        {
            var buffer = sidecar.index_buffer;
            if (string.IsNullOrEmpty(buffer?.file))
                return null;
            var path = Sidecar.Beside(glb, buffer.file);
            var bytes = File.Exists(path) ? File.ReadAllBytes(path) : new byte[0];
            var size = buffer.type == "uint16" ? 2 : 4;
            if (sidecar.levels.Any(level => size * (level.buffer_back_first + level.indices) > bytes.Length))
            {
                warn($"{path}: it is missing or cut off, so back faces have the order of front faces");
                return null;
            }
            return Enumerable.Range(0, bytes.Length / size)
                .Select(i => size == 2 ? BitConverter.ToUInt16(bytes, 2 * i) : (int)BitConverter.ToUInt32(bytes, 4 * i))
                .ToArray();
        }

        int[] Turned(int[] backs, SidecarLevel level, string glb)
        {
            var chosen = new int[level.indices];
            Array.Copy(backs, level.buffer_back_first, chosen, 0, level.indices);
            return Glb.Mirrored(chosen, Positions.Length, glb);
        }
    }

    /// A binary glTF file as Hairloom writes it: one primitive for each level, floats or rounded numbers.
    sealed class Glb
    {
        const uint Magic = 0x46546C67, JsonChunk = 0x4E4F534A;
        const int Byte = 5120, UnsignedByte = 5121, Short = 5122, UnsignedShort = 5123;
        const int UnsignedInt = 5125, Float = 5126;
        const string Changed = "another program has changed it since; use the file that Hairloom wrote";

        readonly string path;
        readonly byte[] bytes;
        readonly int binary;
        readonly Document document;

        public Glb(string path)
        {
            this.path = path;
            bytes = File.ReadAllBytes(path);
            if (bytes.Length < 28 || BitConverter.ToUInt32(bytes, 0) != Magic
                || BitConverter.ToUInt32(bytes, 16) != JsonChunk)
                throw Fault("it is no binary glTF file");
            long size = BitConverter.ToUInt32(bytes, 12);
            if (28 + size > bytes.Length || BitConverter.ToUInt32(bytes, 8) > bytes.Length)
                throw Fault("it is cut off; copy it again");
            try
            {
                document = JsonUtility.FromJson<Document>(Encoding.UTF8.GetString(bytes, 20, (int)size));
            }
            catch (ArgumentException error)
            {
                throw Fault($"its JSON cannot be read ({error.Message})");
            }
            if (document?.nodes == null || document.meshes == null || document.accessors == null
                || document.bufferViews == null)
                throw Fault(Changed);
            binary = 28 + (int)size;
        }

        /// Of the screen, at which each level ends.
        public float[] Coverage(string node)
        {
            return Named(node).extras?.MSFT_screencoverage ?? new float[0];
        }

        public CardLevel Level(SidecarLevel expected)
        {
            var node = Named(expected.node);
            var mesh = At(document.meshes, node.mesh);
            if (mesh.primitives == null || mesh.primitives.Length != 1)
                throw Fault(Changed);
            var corners = mesh.primitives[0].attributes;
            var position = Floats(corners.POSITION, "VEC3");
            var normal = Floats(corners.NORMAL, "VEC3");
            var place = Floats(corners.TEXCOORD_0, "VEC2");
            var count = position.Length / 3;
            // what another program has taken for unused: any direction; open to the light, at the root
            var isWhole = corners.TANGENT >= 0 && corners.TEXCOORD_1 >= 0;
            var across = corners.TANGENT >= 0
                ? Floats(corners.TANGENT, "VEC4")
                : Made(4 * count, i => i % 4 == 0 || i % 4 == 3 ? 1.0f : 0.0f);
            var occlusion = corners.TEXCOORD_1 >= 0
                ? Floats(corners.TEXCOORD_1, "VEC2")
                : Made(2 * count, i => i % 2 == 0 ? 1.0f : 0.0f);
            var indices = Indices(mesh.primitives[0].indices);
            if (new[] { normal.Length / 3, across.Length / 4, place.Length / 2, occlusion.Length / 2 }
                .Any(other => other != count))
                throw Fault(Changed);
            return new CardLevel
            {
                Name = expected.node,
                Positions = Made(count, i => Vector(Placed(position, 3 * i, node), 0)),
                Normals = Made(count, i => Vector(normal, 3 * i)),
                Places = Made(count, i => new Vector2(place[2 * i], 1.0f - place[2 * i + 1])),
                Occlusion = Made(count, i => new Vector2(occlusion[2 * i], occlusion[2 * i + 1])),
                Tangents = Made(count, i => Along(Vector(normal, 3 * i), Vector(across, 4 * i), across[4 * i + 3])),
                Front = Mirrored(indices, count, path),
                IsAsWritten = isWhole && indices.Length == expected.indices
                    && (expected.indices_adler32 == 0 || Adler32(indices) == expected.indices_adler32),
            };
        }

        /// Triangles in the same order, of which Unity takes the same side as the front.
        public static int[] Mirrored(int[] indices, int count, string path)
        {
            if (indices.Length % 3 != 0 || indices.Any(index => index < 0 || index >= count))
                throw new CardFileException($"{path}: triangles name vertices that it does not have; {Changed}");
            return Made(indices.Length, i => indices[i % 3 == 1 ? i + 1 : i % 3 == 2 ? i - 1 : i]);
        }

        /// Of 32-bit little-endian numbers.
        static uint Adler32(int[] indices)
        {
            uint low = 1, high = 0;
            foreach (var index in indices)
                for (var shift = 0; shift < 32; shift += 8)
                {
                    low = (low + (uint)(index >> shift & 255)) % 65521;
                    high = (high + low) % 65521;
                }
            return high * 65536 + low;
        }

        static T[] Made<T>(int count, Func<int, T> make)
        {
            var made = new T[count];
            for (var i = 0; i < count; i++)
                made[i] = make(i);
            return made;
        }

        /// Rounded positions are scaled back by their node.
        static float[] Placed(float[] values, int first, Node node)
        {
            return Made(3, k => values[first + k] * node.scale[k] + node.translation[k]);
        }

        static Vector3 Vector(float[] values, int first)
        {
            return new Vector3(-values[first], values[first + 1], values[first + 2]);
        }

        /// In glTF strands run along cross(normal, tangent), which a mirror turns around: of the axes here, and
        /// of cards that an artist has mirrored, whose tangents have -1 as their fourth number.
        static Vector4 Along(Vector3 normal, Vector3 across, float side)
        {
            var along = Vector3.Cross(normal, across);
            return new Vector4(-side * along.x, -side * along.y, -side * along.z, 1.0f);
        }

        Node Named(string name)
        {
            return document.nodes.FirstOrDefault(node => node.name == name)
                ?? throw Fault($"it has no {name}, which its sidecar names; {Changed}");
        }

        /// Numbers of an accessor, also those that another program has rounded (KHR_mesh_quantization).
        float[] Floats(int number, string type)
        {
            var accessor = At(document.accessors, number);
            if (accessor.type != type)
                throw Fault(Changed);
            var width = type[3] - '0';
            var size = SizeOf(accessor.componentType);
            var stride = StrideOf(accessor, width * size);
            var start = Start(accessor, stride, width * size);
            return Made(accessor.count * width, i =>
                Number(start + i / width * stride + i % width * size, accessor));
        }

        int SizeOf(int componentType)
        {
            switch (componentType)
            {
                case Byte: case UnsignedByte: return 1;
                case Short: case UnsignedShort: return 2;
                case Float: return 4;
                default: throw Fault($"its vertices are compressed; {Changed}");
            }
        }

        float Number(int place, Accessor accessor)
        {
            switch (accessor.componentType)
            {
                case Byte: return Scaled((sbyte)bytes[place], sbyte.MaxValue, accessor.normalized);
                case UnsignedByte: return Scaled(bytes[place], byte.MaxValue, accessor.normalized);
                case Short: return Scaled(BitConverter.ToInt16(bytes, place), short.MaxValue, accessor.normalized);
                case UnsignedShort:
                    return Scaled(BitConverter.ToUInt16(bytes, place), ushort.MaxValue, accessor.normalized);
                default: return BitConverter.ToSingle(bytes, place);
            }
        }

        static float Scaled(int value, int most, bool isNormalized)
        {
            return isNormalized ? Math.Max(value / (float)most, -1.0f) : value;
        }

        int[] Indices(int number)
        {
            var accessor = At(document.accessors, number);
            if (accessor.componentType != UnsignedShort && accessor.componentType != UnsignedInt)
                throw Fault($"its triangles are compressed; {Changed}");
            var size = accessor.componentType == UnsignedShort ? 2 : 4;
            var start = Start(accessor, size, size);
            return Made(accessor.count, i => size == 2
                ? BitConverter.ToUInt16(bytes, start + 2 * i)
                : (int)BitConverter.ToUInt32(bytes, start + 4 * i));
        }

        int StrideOf(Accessor accessor, int size)
        {
            var stride = At(document.bufferViews, accessor.bufferView).byteStride;
            return stride == 0 ? size : stride;
        }

        int Start(Accessor accessor, int stride, int size)
        {
            var view = At(document.bufferViews, accessor.bufferView);
            var first = (long)view.byteOffset + accessor.byteOffset;
            var length = accessor.count == 0 ? 0 : (long)stride * (accessor.count - 1) + size;
            if (view.buffer != 0 || stride < size || length < 0 || first < 0
                || accessor.byteOffset + length > view.byteLength || binary + first + length > bytes.Length)
                throw Fault(Changed);
            return (int)(binary + first);
        }

        T At<T>(T[] all, int number)
        {
            return number >= 0 && number < all.Length ? all[number] : throw Fault(Changed);
        }

        CardFileException Fault(string what)
        {
            return new CardFileException($"{path}: {what}");
        }

#pragma warning disable 649  // the fields are read from JSON
        [Serializable]
        sealed class Document
        {
            public Node[] nodes;
            public Mesh[] meshes;
            public Accessor[] accessors;
            public BufferView[] bufferViews;
        }

        [Serializable]
        sealed class Node
        {
            public string name;
            public int mesh = -1;
            public float[] scale = { 1.0f, 1.0f, 1.0f }, translation = { 0.0f, 0.0f, 0.0f };
            public Extras extras;
        }

        [Serializable]
        sealed class Extras
        {
            public float[] MSFT_screencoverage;
        }

        [Serializable]
        sealed class Mesh
        {
            public Primitive[] primitives;
        }

        [Serializable]
        sealed class Primitive
        {
            public Attributes attributes;
            public int indices = -1;
        }

        [Serializable]
        sealed class Attributes
        {
            public int POSITION = -1, NORMAL = -1, TANGENT = -1, TEXCOORD_0 = -1, TEXCOORD_1 = -1;
        }

        [Serializable]
        sealed class Accessor
        {
            public int bufferView = -1, byteOffset, componentType, count;
            public bool normalized;
            public string type;
        }

        [Serializable]
        sealed class BufferView
        {
            public int buffer, byteOffset, byteLength, byteStride;
        }
#pragma warning restore 649
    }
}
