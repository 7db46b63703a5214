using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using UnityEngine;

namespace Hairloom
{
    /// What cannot be read, where, and what to do.
    public sealed class CardFileException : Exception
    {
        public CardFileException(string message) : base(message) { }
    }

    /// NAME.hairloom.json: what is needed of it here. The fields have the names that the file has.
    [Serializable]
    public sealed class Sidecar
    {
        const int Version = 2;
        const string Ending = ".hairloom.json";

        public int hairloom_sidecar;
        public string file;
        public SidecarLevel[] levels;
        public float opaque_alpha;
        public float min_alpha;
        public SidecarTextures textures;
        public SidecarMaterial material;
        public SidecarIndexBuffer index_buffer;

        public static string PathOf(string glb)
        {
            return Path.ChangeExtension(glb, null) + Ending;
        }

        /// The GLB of a sidecar; any other path as it is.
        public static string GlbOf(string path)
        {
            return path.EndsWith(Ending) ? path.Substring(0, path.Length - Ending.Length) + ".glb" : path;
        }

        public static bool IsBeside(string path)
        {
            return path.EndsWith(".glb", StringComparison.OrdinalIgnoreCase) && File.Exists(path)
                && File.Exists(PathOf(path));
        }

        /// A file of the same export, as Unity writes paths on every system.
        public static string Beside(string glb, string file)
        {
            if (Path.GetFileName(file) != file)
                throw new CardFileException($"{PathOf(glb)}: {file} lies elsewhere; export the cards again");
            return Path.Combine(Path.GetDirectoryName(glb) ?? "", file).Replace('\\', '/');
        }

        /// What is absent from the file comes without a name.
        internal static Dictionary<string, SidecarTexture> Given(Dictionary<string, SidecarTexture> all)
        {
            return all.Where(each => !string.IsNullOrEmpty(each.Value?.file))
                .ToDictionary(each => each.Key, each => each.Value);
        }

        public static Sidecar Of(string glb)
        {
            var path = PathOf(glb);
            if (!File.Exists(path))
                throw new CardFileException($"{path}: it is missing; export the cards again, and copy all files");
            Sidecar sidecar;
            try
            {
                sidecar = JsonUtility.FromJson<Sidecar>(File.ReadAllText(path));
            }
            catch (ArgumentException error)
            {
                throw new CardFileException($"{path}: it is no JSON ({error.Message}); export the cards again");
            }
            if (sidecar == null || sidecar.levels == null || sidecar.levels.Length == 0)
                throw new CardFileException($"{path}: it is no sidecar of Hairloom; export the cards again");
            if (sidecar.hairloom_sidecar > Version)
                throw new CardFileException($"{path}: a newer Hairloom wrote it; update this package");
            return sidecar;
        }
    }

    [Serializable]
    public sealed class SidecarLevel
    {
        public string node;
        public int triangles;
        public int indices;
        public uint indices_adler32;
        public int buffer_back_first = -1;
    }

    [Serializable]
    public sealed class SidecarIndexBuffer
    {
        public string file;
        public string type;
    }

    [Serializable]
    public sealed class SidecarTextures
    {
        public string highlights_by;
        public SidecarFacing view_compensated_alpha;
        public SidecarTexture color;
        public SidecarTexture @base;
        public SidecarTexture alpha;
        public SidecarTexture shift;
        public SidecarTexture noise;
        public SidecarTexture tangent;
        public SidecarTexture normal;

        /// Whether alpha lies in the fourth channel of the colour's file, where Unity's own materials look for it.
        public bool HasAlphaInColor => alpha?.file == color?.file && alpha?.channels == "a";

        /// By their roles, those that the shader reads and this export has.
        public Dictionary<string, SidecarTexture> Used()
        {
            return Sidecar.Given(new Dictionary<string, SidecarTexture>
            {
                ["color"] = color, ["base"] = @base, ["alpha"] = alpha, ["shift"] = shift, ["noise"] = noise,
                ["tangent"] = tangent, ["normal"] = normal,
            });
        }
    }

    [Serializable]
    public sealed class SidecarTexture
    {
        public string file;
        public string channels = "r";
        public string inverted = "";
        public string color_space;
        public float gain = 1.0f;

        /// Which channel holds what is one number, such as alpha in the fourth one of another picture.
        public Vector4 Mask()
        {
            var mask = new Vector4();
            mask[Math.Max("rgba".IndexOf(channels[0]), 0)] = 1.0f;
            return mask;
        }

        /// What a component of a direction is made of, see hair_texel; one that the file has not is 0.
        public Vector4 Lanes(int axis)
        {
            if (axis >= channels.Length)
                return new Vector4(0.0f, 0.0f, 0.0f, 0.5f);
            var isInverted = inverted.IndexOf(channels[axis]) >= 0;
            var lanes = new Vector4(0.0f, 0.0f, 0.0f, isInverted ? 1.0f : 0.0f);
            lanes[Math.Max("rgb".IndexOf(channels[axis]), 0)] = isInverted ? -1.0f : 1.0f;
            return lanes;
        }
    }

    [Serializable]
    public sealed class SidecarFacing
    {
        public float mean_facing;
        public float min_facing;
    }

    [Serializable]
    public sealed class SidecarMaterial
    {
        public string model;
        public SidecarValues values;
        public SidecarFibre fibre;
        public SidecarTables tables;
    }

    /// Names as in the shader, with an underscore before them.
    [Serializable]
    public sealed class SidecarValues
    {
        public float[] base_color = { 0.3f, 0.2f, 0.1f };
        public float[] tip_color = { 0.3f, 0.2f, 0.1f };
        public float tip_tint;
        public float tint_start = 0.3f;
        public float tint_end = 0.9f;
        public float grey_fraction;
        public float shift_noise = 0.2f;
        public float sparkle = 0.6f;
        public float ambient = 1.0f;
        public float[] primary_color = { 1.0f, 1.0f, 1.0f };
        public float primary_strength = 1.0f;
        public float primary_exponent = 200.0f;
        public float primary_shift = 0.12f;
        public float[] secondary_color = { 1.0f, 1.0f, 1.0f };
        public float secondary_strength = 1.0f;
        public float secondary_exponent = 60.0f;
        public float secondary_shift = -0.2f;
        public float fake_scattering = 0.8f;
        public float volume_shadow = 1.0f;
    }

    [Serializable]
    public sealed class SidecarFibre
    {
        public float[] root;
        public float[] tip;
        public float[] strengths;
    }

    [Serializable]
    public sealed class SidecarTables
    {
        public SidecarTexture longitudinal;
        public SidecarTexture azimuthal;
        public SidecarTexture paths;

        public Dictionary<string, SidecarTexture> All()
        {
            return Sidecar.Given(new Dictionary<string, SidecarTexture>
            {
                ["longitudinal"] = longitudinal, ["azimuthal"] = azimuthal, ["paths"] = paths,
            });
        }
    }
}
